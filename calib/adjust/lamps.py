"""One lamp while it is being found: what the manifest says, the first guess, where its highlights belong."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.adjust.bundle import Values
from photogonio.calib.detect.lamp_markers import marked_place
from photogonio.calib.detect.mirror_rays import MirroredRay, meet, mirrored_ray
from photogonio.calib.detect.observation import Observation, light_entry
from photogonio.calib.detect.photo_reader import Progress
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.mirror import mirrored_direction, mirrored_point
from photogonio.calib.parallel import abreast
from photogonio.calib.setup import PrintTone
from photogonio.calib.shading.initial import first_fit
from photogonio.calib.shading.model import ShadingScene
from photogonio.capture.photoset import LightEntry, LooseMarkers, PhotoSet, Sphere

_FAR = 25.0  # board diagonals beyond which a lamp counts as distant


@dataclass(frozen=True, slots=True)
class Lamp:
    """One light id while it is being settled."""

    name: str
    entry: LightEntry | None
    kind: str  # "point" | "directional"
    block: np.ndarray  # (3,) place, direction, or place in the camera's frame if attached
    source: str
    fixed: bool = False
    one_ray: bool = False  # only one highlight speaks for it: its distance is not known
    place_sigma: float = 0.0  # of a place by markers, length units; 0: no such place

    @property
    def attached(self) -> bool:
        """Whether it moves with the camera."""
        return self.entry is not None and self.entry.attached_to == "camera"


def block_name(light: str) -> str:
    """The name under which a lamp's place is adjusted."""
    return f"light {light}"


def place_in_world(lamp: Lamp, block: np.ndarray, pose: Pose) -> np.ndarray:
    """A lamp's place (or direction) in the world frame, seen from the camera's ``pose``."""
    return pose.inverse().apply(block) if lamp.attached else block


def expected_pixel(
    camera: Camera, observation: Observation, lamp: Lamp, values: Values, number: int
) -> np.ndarray:
    """Where a lamp's highlight in a mirror ball belongs, (2,) pixels."""
    block, pose = values[f"ball {number}"], observation.pose
    place = place_in_world(lamp, values[block_name(lamp.name)], pose)
    if lamp.kind == "directional":
        point = mirrored_direction(block[:3], block[3], pose.center, place / np.linalg.norm(place))
    else:
        point = mirrored_point(block[:3], block[3], pose.center, place)
    return camera.project(pose, point[None])[0]


def sight_rays(photoset: PhotoSet, camera: Camera, observation: Observation) -> list[MirroredRay]:
    """The mirrored rays of one photo's highlights."""
    rays = [
        mirrored_ray(camera, observation.pose, photoset.mirror_balls[h.ball], h)
        for h in observation.highlights
    ]
    return [r for r in rays if r is not None]


def start_lamps(
    photoset: PhotoSet,
    camera: Camera,
    groups: dict[str, list[Observation]],
    scene: ShadingScene | None,
    tell: Progress,
    workers: int = 1,
) -> dict[str, Lamp]:
    """First guesses of all lamps that something tells about, by id."""

    def start(name: str) -> Lamp | None:
        entry = _entry(photoset, groups[name])
        return start_lamp(photoset, camera, name, entry, groups[name], scene)

    lamps = {}
    for k, (name, lamp) in enumerate(zip(groups, abreast(start, groups, workers), strict=True)):
        if lamp is not None:
            lamps[name] = lamp
        tell("finding the lights", k + 1, len(groups))
    return _bring_near(photoset, lamps, groups, camera)


def told_lamps(
    photoset: PhotoSet, groups: dict[str, list[Observation]], tone: PrintTone | None
) -> dict[str, Lamp]:
    """Lamps that print told with a tone curve, where the manifest does not."""
    found = {}
    for name, place in () if tone is None else zip(tone.lamps, tone.places, strict=True):
        if name not in groups:
            continue
        entry = _entry(photoset, groups[name])
        if entry is None or (
            entry.kind != "directional" and not entry.marker_ids and _given(name, entry) is None
        ):
            found[name] = Lamp(name, entry, "point", place, "board")
    return found


def _entry(photoset: PhotoSet, members: list[Observation]) -> LightEntry | None:
    return light_entry(photoset, members[0].view)


def start_lamp(
    photoset: PhotoSet,
    camera: Camera,
    name: str,
    entry: LightEntry | None,
    observations: list[Observation],
    scene: ShadingScene | None,
) -> Lamp | None:
    """A first place for one light; None if nothing tells it."""
    given = _given(name, entry) or _marked(photoset, camera, name, entry, observations)
    if given is not None:
        return given
    kind = entry.kind if entry is not None else None
    board, paper = photoset.board, next((s for s in observations if s.has_paper), None)
    reading = None if paper is None else paper.reading
    attached = entry is not None and entry.attached_to == "camera"
    seen = [paper or observations[0]] if attached else observations
    rays = [ray for s in seen for ray in sight_rays(photoset, camera, s)]
    source = "probe" if any(s.probe and s.highlights for s in seen) else "mirror balls"
    if scene is not None and board is not None and paper is not None and reading is not None:
        diagonal = float(np.hypot(*board_size(board)))
        paper.shading = local = first_fit(reading, scene, rays, middle_of(photoset), diagonal)
        place = paper.pose.apply(local[:3]) if attached else local[:3]
        return Lamp(name, entry, "point", place, source if rays else "board")  # however far: see as_distant
    if not rays:
        return None
    span = max(float(np.linalg.norm(b.center)) for b in photoset.mirror_balls) + 1.0
    met = meet(rays, kind, span)
    place = seen[0].pose.apply(met.place) if attached and met.kind == "point" else met.place
    return Lamp(name, entry, met.kind, place, source, one_ray=len(rays) == 1)


def as_distant(
    photoset: PhotoSet, lamp: Lamp, place: np.ndarray, covariance: np.ndarray
) -> tuple[Lamp, np.ndarray, np.ndarray] | None:
    """A lamp that settled at ``place`` (3,) as a direction (3,) with its covariance (3, 3) if it is distant; else None.

    Settled it is as a point however far it stands: edges of shadows on the paper tell its direction better than small
    mirror balls do.
    """
    told = None if lamp.entry is None else lamp.entry.kind
    if photoset.board is None or lamp.kind != "point" or lamp.fixed or lamp.attached or told == "point":
        return None
    offset = place - middle_of(photoset)
    reach = float(np.linalg.norm(offset))
    toward, diagonal = offset / reach, float(np.hypot(*board_size(photoset.board)))
    if told is None and reach < _FAR * diagonal:
        return None
    across = np.eye(3) - np.outer(toward, toward)
    return replace(lamp, kind="directional"), toward, across @ covariance @ across / reach**2


def _given(name: str, entry: LightEntry | None) -> Lamp | None:
    if entry is not None and entry.position is not None:
        source = "camera" if entry.attached_to == "camera" else "given"
        return Lamp(name, entry, "point", np.asarray(entry.position, float), source, fixed=True)
    if entry is not None and entry.direction is not None:
        toward = np.asarray(entry.direction, float)
        return Lamp(name, entry, "directional", toward / np.linalg.norm(toward), "given", fixed=True)
    return None


def _marked(
    photoset: PhotoSet, camera: Camera, name: str, entry: LightEntry | None, observations: list[Observation]
) -> Lamp | None:
    """By markers on the lamp: the mean over the photos that show them."""
    if entry is None or not entry.marker_ids:
        return None
    board = photoset.board
    length = None if board is None or isinstance(board, LooseMarkers) else board.marker_length
    found = [
        p for s in observations if (p := marked_place(camera, s.pose, s.corners, entry, length)) is not None
    ]
    if not found:
        return None
    place = np.mean([p.place for p in found], axis=0)
    sigma = float(np.sqrt(np.mean([p.sigma**2 for p in found]) / len(found)))
    return Lamp(name, entry, "point", place, "markers", place_sigma=sigma)


def _bring_near(
    photoset: PhotoSet, lamps: dict[str, Lamp], groups: dict[str, list[Observation]], camera: Camera
) -> dict[str, Lamp]:
    """Lamps known by one ray only stand as far as the set's other lamps do, if those are near."""
    near = [lamp.block for lamp in lamps.values() if lamp.kind == "point" and not lamp.attached]
    lonely = [lamp for lamp in lamps.values() if lamp.kind == "directional" and lamp.one_ray]
    lonely = [lamp for lamp in lonely if lamp.entry is None or lamp.entry.kind is None]
    if not near or not lonely:
        return lamps
    middle = middle_of(photoset)
    reach = float(np.median([np.linalg.norm(p - middle) for p in near]))
    moved = dict(lamps)
    for lamp in lonely:
        ray = next(r for s in groups[lamp.name] for r in sight_rays(photoset, camera, s))
        place = ray.origin + reach * ray.direction
        moved[lamp.name] = Lamp(lamp.name, lamp.entry, "point", place, lamp.source, one_ray=True)
    return moved


def middle_of(photoset: PhotoSet) -> np.ndarray:
    """The middle (3,) of the board, or of the sample where there is none."""
    if photoset.board is not None:
        return np.append(board_size(photoset.board) / 2, 0.0)
    sample = photoset.sample
    if isinstance(sample, Sphere):
        return np.asarray(sample.center, float)
    return np.append(np.mean(sample.outline, axis=0), sample.height)
