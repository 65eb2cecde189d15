"""Where the lamp of one photo stands, about: by polished balls if there are any, else by how the board is lit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.calib.detect.highlights import find_highlight
from photogonio.calib.detect.mirror_rays import MirroredRay, meet, mirrored_ray
from photogonio.calib.detect.paper import PaperSamples, paper_places
from photogonio.calib.detect.paper_reading import PaperReading, local_noise
from photogonio.calib.geometry.board import board_size, millimetre
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.identify.quick_look import QuickLook
from photogonio.calib.shading.fit import fit_local
from photogonio.calib.shading.initial import black_over_white, first_fit, misfit, thinned
from photogonio.calib.shading.model import Ball, LitPaper, ShadingScene
from photogonio.capture.photoset import PhotoSet, Sphere
from photogonio.capture.radiance import RadianceImage

ACROSS = 90  # samples of paper along the board's longer side
FEWEST = 120  # of them, in all
SOFT_LAMP = 6.0  # mm: what a lamp's radius may be
BLUR = 0.3  # likewise: of a shadow's edge by lens and pixels
LOWEST = 0.06  # sine of the elevation below which no lamp is believed
GOOD = 0.3  # misfit of the shading below which its lamp is believed
LEAST_NOISE = 0.01
SAMPLES = 900
FAR = 20.0  # of the board's diagonal: a lamp whose direction alone is known


@dataclass(frozen=True, slots=True)
class LampGlance:
    """A lamp as one photo shows it."""

    place: np.ndarray  # (3,) board frame
    source: str  # "mirror balls" (and how the paper is lit) | "paper"
    misfit: float  # 0 to 1, of the paper's light; 1: balls alone tell


def glance_at_lamp(photoset: PhotoSet, camera: Camera, pose: Pose, seen: QuickLook) -> LampGlance | None:
    """The lamp of a photo whose camera and pose are known about; None if nothing tells."""
    if photoset.board is None:
        return None
    small = shrunk(camera, seen.step, seen.small.shape)
    size = board_size(photoset.board)
    diagonal = float(np.hypot(*size))
    rays = _rays(photoset, small, pose, seen)
    found = _by_paper(photoset, small, pose, seen, rays, diagonal)
    if found is None and len(rays) > 1:
        met = meet(rays, None, diagonal)
        place = met.place if met.kind == "point" else FAR * diagonal * met.place
        return LampGlance(place, "mirror balls", 1.0)
    return found


def shrunk(camera: Camera, step: int, shape: tuple[int, ...]) -> Camera:
    """The camera of pictures made smaller ``step`` times."""
    matrix = camera.matrix / step
    matrix[2, 2] = 1.0
    matrix[:2, 2] = (camera.matrix[:2, 2] - 0.5 * (step - 1)) / step
    return Camera(matrix, camera.distortion, (shape[1], shape[0]))


def _rays(photoset: PhotoSet, camera: Camera, pose: Pose, seen: QuickLook) -> list[MirroredRay]:
    value = seen.small[..., None]
    image = RadianceImage(value, np.zeros_like(value), ~seen.full, seen.full)
    rays = []
    for number, ball in enumerate(photoset.mirror_balls):
        found = find_highlight(image, camera, pose, ball, number)
        ray = None if found is None else mirrored_ray(camera, pose, ball, found)
        if ray is not None and ray.direction[2] > 0:
            rays.append(ray)
    return rays


def _by_paper(
    photoset: PhotoSet,
    camera: Camera,
    pose: Pose,
    seen: QuickLook,
    rays: list[MirroredRay],
    diagonal: float,
) -> LampGlance | None:
    reading = glance_at_paper(photoset, camera, pose, seen)
    if reading is None:
        return None
    sample = photoset.sample
    ball = Ball(np.asarray(sample.center, float), sample.radius) if isinstance(sample, Sphere) else None
    polished = tuple(Ball(np.asarray(b.center, float), b.radius) for b in photoset.mirror_balls)
    reading = thinned(reading, SAMPLES)
    unit = millimetre(photoset)
    scene = ShadingScene(polished, ball, SOFT_LAMP * unit, black_over_white([reading]), BLUR * unit)
    middle = np.append(0.5 * board_size(photoset.board), 0.0)  # type: ignore[arg-type]
    tried = [first_fit(reading, scene, rays, middle, diagonal)[:3]]
    if not rays:  # a flash
        tried.append(fit_local(LitPaper.of(reading), scene, pose.center)[:3])
    missed = [misfit(reading, scene, place) for place in tried]
    best = int(np.argmin(missed))
    place = tried[best]
    if missed[best] > GOOD or place[2] < LOWEST * float(np.linalg.norm(place - middle)):
        return None
    return LampGlance(place.copy(), "mirror balls" if rays else "paper", missed[best])


def glance_at_paper(photoset: PhotoSet, camera: Camera, pose: Pose, seen: QuickLook) -> PaperReading | None:
    """White and black print as the small picture shows it; None if too little is seen."""
    step = float(board_size(photoset.board).max()) / ACROSS  # type: ignore[arg-type]
    places = paper_places(photoset, camera, pose, step=step, apart=3.0, clear_of_edges=(1.6, 2.2))
    if places is None or len(places.points) < FEWEST:
        return None
    x, y = np.round(places.pixels).astype(int).T
    level = seen.small[y, x].astype(float)
    value = level[:, None]
    own = (
        places.points,
        places.white,
        value,
        np.zeros_like(value),
        places.square,
        places.spread,
        places.aside,
    )
    samples = PaperSamples(*own).keep(~seen.full[y, x] & (level > 0))
    if len(samples) < FEWEST or not samples.white.any() or samples.white.all():
        return None
    level = samples.value[:, 0]
    noise = (np.maximum(local_noise(samples, level), LEAST_NOISE) * level) ** 2
    return PaperReading(samples, level, noise)
