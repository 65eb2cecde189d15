"""What the white patch and the board's paper say in one view of the strength of its lamp."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.adjust.state import Settled
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.radiometry.patch import (
    LEAST_TILT,
    NoStrength,
    Stray,
    Strength,
    light_shape,
    read_paper,
    read_patch,
)
from photogonio.calib.setup import Light
from photogonio.calib.shading.interreflection import diffuse_bounce
from photogonio.calib.shading.model import ShadingScene
from photogonio.calib.shading.parameters import TILTS
from photogonio.capture import robust
from photogonio.capture.photoset import PhotoSet
from photogonio.capture.radiance import RadianceImage

WORST = 4.0  # standard errors beyond which a patch is not believed against the others
ALIKE = 0.03  # relative difference of patches in one photo
DARKER = "a patch is much darker than another: not believed"
NO_PATCH = "the set has no white patch"
_SEEN = 0.999  # share of the lamp that a place must see
_FEW_SAMPLES = 300


@dataclass(frozen=True, slots=True)
class StrengthReadings:
    """One view's readings, as strengths of the lamp times what is not known of the surface."""

    patch: Strength | NoStrength  # the lamp's own: the patch's reflectance is known
    paper: Strength | NoStrength  # times the white paper's reflectance over pi
    black: Strength | NoStrength  # times the black print's

    @property
    def both(self) -> tuple[Strength, Strength] | None:
        """Patch and paper where both were read."""
        patch, paper = self.patch, self.paper
        return (patch, paper) if isinstance(patch, Strength) and isinstance(paper, Strength) else None


def read_view(
    photoset: PhotoSet, image: RadianceImage, settled: Settled, observation: Observation, light: Light
) -> StrengthReadings:
    """What patch and paper of one view say."""
    paper = observation.reading
    stray = None if paper is None else stray_light(settled, observation, paper, light)
    readings = []
    for sheet in photoset.white_patches:
        one = read_patch(image, settled.camera, observation.pose, light, sheet, stray)
        readings.append(_of_lamp(one, np.asarray(sheet.reflectance, float)))
    good = [r for r in readings if isinstance(r, Strength)]
    refused = [r for r in readings if isinstance(r, NoStrength)]
    refused.sort(key=lambda r: r.rough is None)  # what tells something in spite of it first
    patch = _mean(good) if good else (*refused, NoStrength(NO_PATCH))[0]
    if paper is None:
        return StrengthReadings(patch, NoStrength("no paper is seen"), NoStrength("no print is seen"))
    shown = light_shape(paper.samples.points, light, stray)
    white, black = (read_paper(paper, light, stray, white=tone, shown=shown) for tone in (True, False))
    return StrengthReadings(patch, white, black)


def _of_lamp(one: Strength | NoStrength, reflectance: np.ndarray) -> Strength | NoStrength:
    """A patch's reading without what its reflectance did to it."""
    if isinstance(one, NoStrength):
        return one if one.rough is None else replace(one, rough=_told_lamp(one.rough, reflectance))
    return _told_lamp(one, reflectance)


def _told_lamp(one: Strength, reflectance: np.ndarray) -> Strength:
    factor = np.pi / np.broadcast_to(reflectance, one.value.shape)
    return Strength(one.value * factor, one.error * factor, one.pull)


def stray_light(
    settled: Settled, observation: Observation, paper: PaperReading, light: Light
) -> Stray | None:
    """The light beside the direct one that shading found in this view, whose ``paper`` was read."""
    if settled.scene is None or observation.shading is None or light.kind != "point":
        return None
    points = paper.samples.points
    toward, falloff = light.toward(points)
    even = float(np.median(np.clip(toward[:, 2], 0, None) * falloff))
    tilt = aimed(settled.scene, paper, observation.shading[TILTS])
    stray = Stray(settled.scene, np.clip(observation.shading[4:7], 0.0, None), even, tilt)
    return replace(stray, amounts=_coloured(stray, paper, light))


def aimed(scene: ShadingScene, paper: PaperReading, tilts: np.ndarray) -> tuple[float, float, float]:
    """The tilt of a narrow lamp's light by ``tilts`` (2,) over its paper, 1 where the lamp is taken to point: one that
    points beside it lights one side of the board more. What little tilt other lamps' light has may as well be the
    paper's or the lens's, and stays."""
    if scene.narrow == 0.0:
        return 1.0, 0.0, 0.0
    low, high = paper.span
    slope = 2 * tilts / (high - low)
    slope = slope / max(1.0 + slope @ (np.array(scene.aim[:2]) - (low + high) / 2), LEAST_TILT)
    return (float(1.0 - slope @ scene.aim[:2]), *slope.tolist())


def _coloured(stray: Stray, reading: PaperReading, light: Light) -> np.ndarray:
    """The amounts (3, c) channel by channel: a coloured sample throws coloured light.

    Shading was fitted to the mean of the channels. Each channel over that fit is one constant but for the diffuse
    bounce's share, in which channels may differ; what all of them have in common is a misfit, and stays out of it.
    """
    channels = reading.samples.value.shape[1]
    amounts = np.repeat(stray.amounts[:, None], channels, axis=1)
    if channels == 1 or stray.scene.sample is None:
        return amounts
    ball, points = stray.scene.sample, reading.samples.points
    shape, share = light_shape(points, light, stray)
    good = reading.samples.white & (share > _SEEN) & (shape[:, 0] > 0)
    if good.sum() < _FEW_SAMPLES:
        return amounts
    shape = shape[good, 0]
    thrown = diffuse_bounce(points[good], light.place, ball.center, ball.radius) / shape
    design = np.column_stack([np.ones(len(thrown)), thrown])
    ratio = reading.samples.value[good] / shape[:, None]
    ratio /= np.median(ratio, axis=0)
    off = np.zeros(channels)
    for c in range(channels):
        values = _robust_line(design, ratio[:, c])
        off[c] = values[1] / values[0]
    amounts[0] = np.clip(amounts[0] + off - off.mean(), 0.0, 1.0)
    return amounts


def _robust_line(design: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Least squares without what lies three scatters off, three times."""
    kept = np.ones(len(values), bool)
    for _ in range(3):
        found = np.linalg.lstsq(design[kept], values[kept], rcond=None)[0]
        miss = np.abs(values - design @ found)
        kept = miss <= 3 * float(robust.deviation(miss)) + 1e-12
    return found


def _mean(readings: list[Strength]) -> Strength:
    """Several patches of one view: those much darker than the brightest lie in shadow, or are hidden."""
    best = max(readings, key=lambda r: float(np.log(r.value).mean()))
    alike = [r for r in readings if np.all(r.value > best.value * (1 - ALIKE) - WORST * r.error)]
    weight = np.array([r.error**-2.0 for r in alike])
    total = weight.sum(0)
    value = sum(w * r.value for w, r in zip(weight, alike, strict=True)) / total
    pull = np.mean([r.pull for r in alike], axis=0)
    dropped = len(readings) - len(alike)
    return Strength(value, np.sqrt(1 / total), pull, DARKER if dropped else "")
