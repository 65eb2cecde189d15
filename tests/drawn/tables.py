"""Facet tables of a known BRDF without any pictures: the fit's own faults, apart from those of everything before it.

A set is what a camera and a lamp would see of a ball or a plane: directions at every pixel, photon noise, an error of
scale a view, and a few pixels that are spoiled.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.reduce.directions import canonical
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.facet_table import FacetTable, accumulate, add_tables
from photogonio.reconstruct.table.facets import facet_index
from photogonio.reconstruct.table.goniometer_csv import UNBINNED
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.scene.plan import spiral

GRAZING = np.cos(np.radians(85.0))  # pixels beyond are not used, as in the reduction of photos
CHANNELS = ("R", "G", "B")


@dataclass(frozen=True, slots=True)
class Plan:
    """How a set is taken; lengths in units of the ball's radius or of half the plane's width."""

    shape: str = "ball"  # "ball" | "plane"
    views: int = 18
    pixels: int = 6000  # of the sample, in each view
    level: int = 3  # of the facets; UNBINNED: every pixel by itself
    camera: str = "fixed"  # "fixed" | "moving"
    camera_distance: float = 20.0
    lamp_distance: float = 16.0
    lamp_elevation: tuple[float, float] = (18.0, 80.0)  # degrees
    camera_elevation: tuple[float, float] = (25.0, 84.0)  # degrees; their mean where fixed
    electrons: float = 20000.0  # at full scale, which a white surface that faces the lamp reaches
    view_error: float = 0.003  # relative, of each view's scale
    spoiled: float = 0.01  # share of the pixels
    spoiled_by: float = 0.5  # relative size of what spoils them
    isotropic: bool = True  # pairs are turned to one incident azimuth
    lamp_error: float = 0.0  # degrees, of each view's lamp about where it is thought to be
    tilt: float = 0.0  # degrees, of a plane's normal about where it is thought to be, the same in all views
    texture: float = 0.0  # relative rms of a plane's pattern, the same in all views


# a plane under a moving camera and lamps that are a little off: what a test of isotropy is made for
TURNED_PLANE = Plan(
    shape="plane",
    camera="moving",
    isotropic=False,
    views=24,
    pixels=600,
    level=3,
    view_error=0.007,
    lamp_error=0.15,
)


def simulate(brdf: Reflectance, plan: Plan = Plan(), *, seed: int = 0) -> FacetTable:
    """The facet table of a set; the same seed gives the same table."""
    rng = np.random.default_rng(seed)
    cameras, lamps = _places(plan, rng)
    scale = 1.0 + plan.view_error * rng.normal(size=plan.views)
    thought = lamps
    if plan.lamp_error:
        step = np.radians(plan.lamp_error) * plan.lamp_distance
        thought = lamps + step * rng.normal(size=lamps.shape)
    return add_tables(
        [
            _view(brdf, plan, f"s{k:03d}", cameras[k], lamps[k], thought[k], scale[k], rng)
            for k in range(plan.views)
        ]
    )


def phase_of(plan: Plan, seed: int) -> Callable[[Cells], np.ndarray] | None:
    """Cosines of the angle between lamp and camera where cells of the ball of :func:`simulate` are, as calibration
    knows them; None of a plane."""
    if plan.shape == "plane":
        return None
    cameras, lamps = _places(plan, np.random.default_rng(seed))

    def cosines(cells: Cells) -> np.ndarray:
        view = np.array([int(name[1:]) for name in cells.groups])[cells.group]
        toward, back = (_unit(places[view] - cells.place) for places in (lamps, cameras))
        return np.einsum("ij,ij->i", toward, back)

    return cosines


def _places(plan: Plan, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Places (v, 3) of camera and lamp."""
    turn = rng.uniform(0.0, 2.0 * np.pi, 2)
    lamps = spiral(plan.views, plan.lamp_elevation, start=turn[0]) * plan.lamp_distance
    if plan.camera == "moving":
        cameras = spiral(plan.views, plan.camera_elevation, start=turn[1])[rng.permutation(plan.views)]
    else:
        slope = np.radians(np.mean(plan.camera_elevation))
        cameras = np.tile([np.cos(slope), 0.0, np.sin(slope)], (plan.views, 1))
    return cameras * plan.camera_distance, lamps


def _points(plan: Plan, camera: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals (n, 3) that the camera sees, evenly spread over the picture of the sample."""
    x, y = rng.uniform(-1.0, 1.0, (2, plan.pixels))
    if plan.shape == "plane":
        return np.column_stack([x, y, np.zeros_like(x)]), np.tile([0.0, 0.0, 1.0], (plan.pixels, 1))
    inside = x * x + y * y < 0.98
    x, y = x[inside], y[inside]
    forward = camera / np.linalg.norm(camera)
    right = np.cross([0.0, 0.0, 1.0], forward)
    right /= np.linalg.norm(right)
    up = np.cross(forward, right)
    normal = x[:, None] * right + y[:, None] * up + np.sqrt(1.0 - x * x - y * y)[:, None] * forward
    return normal, normal


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _view(brdf, plan, name, camera, lamp, thought, scale, rng) -> FacetTable:
    point, normal = _points(plan, camera, rng)
    toward, back = _unit(lamp - point), _unit(camera - point)
    cos_i = np.einsum("ij,ij->i", toward, normal)
    seen = (cos_i > GRAZING) & (np.einsum("ij,ij->i", back, normal) > GRAZING)
    point, toward, back, normal, cos_i = (a[seen] for a in (point, toward, back, normal, cos_i))
    turned = canonical(toward, back, normal)
    true = brdf(*turned) if plan.shape == "ball" else _of_plane(brdf, plan, point, toward, back)
    irradiance = np.pi * cos_i * plan.lamp_distance**2 / np.sum((lamp - point) ** 2, axis=1)
    if thought is not lamp:
        toward = _unit(thought - point)
        cos_i = np.maximum(np.einsum("ij,ij->i", toward, normal), GRAZING)
        assumed = np.pi * cos_i * plan.lamp_distance**2 / np.sum((thought - point) ** 2, axis=1)
        true = true * (irradiance / assumed)[:, None]
        irradiance, turned = assumed, canonical(toward, back, normal)
    value, variance = _measured(true, irradiance, scale, plan, rng)
    incident, exit = turned if plan.isotropic or plan.shape == "ball" else (toward, back)
    typical = np.median(irradiance * variance.mean(1))
    samples = {
        "channels": CHANNELS[: value.shape[1]],
        "name": name,
        "isotropic": plan.isotropic or plan.shape == "ball",
        "incident": incident,
        "exit": exit,
        "place": point,
        "omega": irradiance / typical,
        "value": value,
        "variance": variance,
    }
    if plan.level == UNBINNED:
        return _singly(**samples)
    facet_i, facet_r = facet_index(incident, plan.level), facet_index(exit, plan.level)
    return accumulate(level=plan.level, facet_i=facet_i, facet_r=facet_r, **samples)


def _singly(*, channels, name, isotropic, incident, exit, place, omega, value, variance) -> FacetTable:
    """What :func:`reconstruct.table.facet_table.accumulate` makes of the same samples, none of them joined."""
    rows, w = np.arange(len(omega), dtype=np.int32), omega[:, None]
    return FacetTable(
        level=UNBINNED,
        channels=channels,
        groups=(name,),
        isotropic=isotropic,
        group=np.zeros(len(omega), np.int32),
        facet_i=rows,
        facet_r=rows.copy(),
        count=np.ones(len(omega)),
        weight=omega,
        value=w * value,
        value2=w * value**2,
        variance=w**2 * variance,
        incident=w * incident,
        exit=w * exit,
        place=w * place,
    )


def _of_plane(brdf, plan: Plan, point: np.ndarray, toward: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Values (n, c) as the plane has them whose normal leans toward x and that bears a pattern of stripes."""
    if plan.tilt:
        cos, sin = np.cos(np.radians(plan.tilt)), np.sin(np.radians(plan.tilt))
        lean = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
        leant = toward @ lean
        share = np.maximum(leant[:, 2], 0.0) / toward[:, 2]  # of the light that is thought to fall on it
        return brdf(leant, back @ lean) * share[:, None] * _pattern(plan, point)
    return brdf(toward, back) * _pattern(plan, point)


def _pattern(plan: Plan, point: np.ndarray) -> np.ndarray:
    return 1.0 + np.sqrt(2.0) * plan.texture * np.sin(5.0 * point[:, :1] + 3.0 * point[:, 1:2])


def _measured(true: np.ndarray, irradiance: np.ndarray, scale: float, plan: Plan, rng):
    """Values and variances (n, c) of pixels as a sensor would give them."""
    signal = np.maximum(true * irradiance[:, None], 1e-6)
    deviation = np.sqrt(signal / plan.electrons + (4.0 / plan.electrons) ** 2)
    noisy = signal + deviation * rng.normal(size=signal.shape)
    spoiled = rng.uniform(size=len(signal)) < plan.spoiled
    noisy[spoiled] *= 1.0 + plan.spoiled_by * np.abs(rng.normal(size=(spoiled.sum(), 1)))
    return noisy * scale / irradiance[:, None], (deviation / irradiance[:, None]) ** 2
