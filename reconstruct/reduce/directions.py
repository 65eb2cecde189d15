"""From the pixels of a view to (incident, exit) directions: the clear, vectorised form.

Everything here is geometry of one view, gathered in a :class:`ViewScene`; :mod:`reconstruct.reduce.fused` does the same
sums, fused, and is tested against this. Angles between rays stand for distances in the picture: a margin of m
pixels is m / (pixels per radian), which is true on the axis and errs to the wide side elsewhere.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall, Plane, Sphere, WhitePatch
from photogonio.reconstruct.reduce.occluders import (
    balls_beside,
    bounding_ball,
    cone_of,
    may_cover,
    may_shade,
    patch_cones,
)
from photogonio.reconstruct.table.facet_table import LEFT_OUT

# with a vertex at the pole, phi = 0 runs along facet edges; phi = 36 degrees is a mirror plane of the
# icosahedron that crosses the facets' middles, so that changing the sign of dphi maps facets onto facets
CANONICAL_AZIMUTH = np.pi / 5.0

USED = -1
OUTSIDE = -2


@dataclass(frozen=True, slots=True)
class ReduceOptions:
    """What the reduction leaves out, and the things around the sample that cover it or shade it."""

    isotropic: bool = True  # turn each pair about the normal; always done on a sphere
    theta_i_max: float = float(np.radians(85.0))  # radians
    theta_r_max: float = float(np.radians(85.0))
    margin: float = 2.0  # pixels from the outline of the sample or of what covers it
    lamp_angle: float = 0.01  # least angular radius of a lamp whose size nobody gave, radians
    mirror_balls: tuple[MirrorBall, ...] = ()
    white_patches: tuple[WhitePatch, ...] = ()


@dataclass(frozen=True, slots=True)
class ViewScene:
    """One view as the reduction sees it: world frame, lengths in the set's unit, unit rays."""

    eye: np.ndarray  # (3,) camera centre
    rotation: np.ndarray  # (3, 3) of the pose
    sphere: np.ndarray  # (4,) centre and radius; radius 0: the sample is a plane
    height: float  # of the plane
    outline: np.ndarray  # (n, 3) inward unit normals of the planes through the eye and the outline's edges
    margin: float  # radians
    covering: np.ndarray  # (b, 4) centre and radius of the mirror balls that may cover the sample
    shading: np.ndarray  # (b, 4) likewise, that may shade it
    patches: tuple[tuple[float, np.ndarray], ...]  # height, (n, 3) inward normals of each cone that covers
    near: bool  # point light
    place: np.ndarray  # (3,) light position, or unit vector toward it
    lamp_radius: float  # length units
    lamp_angle: float  # radians, least
    cos_i_min: float
    cos_r_min: float
    isotropic: bool
    strength: np.ndarray  # (c,)
    light: Light = field(repr=False)


@dataclass(frozen=True, slots=True)
class Pairs:
    """Directions at n pixels; NaN where ``reason`` is OUTSIDE."""

    reason: np.ndarray  # (n,) int8: USED, OUTSIDE, or an index in LEFT_OUT
    point: np.ndarray  # (n, 3) world
    incident: np.ndarray  # (n, 3) unit, tangent frame (canonical azimuth if isotropic)
    exit: np.ndarray  # (n, 3) unit, tangent frame
    irradiance: np.ndarray  # (n,) cos * falloff; times strength it is the irradiance


def scene_of(setup: Setup, view: ViewSetup, options: ReduceOptions) -> ViewScene:
    """Everything about one view that the reduction needs."""
    eye, light = view.pose.center, view.light
    sample = setup.sample
    if isinstance(sample, Sphere):
        sphere, height, outline = np.array([*sample.center, sample.radius]), 0.0, np.zeros((0, 3))
    else:
        sphere, height, outline = np.zeros(4), sample.height, cone_of(eye, _corners(sample))
    balls, bounds = balls_beside(options.mirror_balls, sample), bounding_ball(sample)
    margin = options.margin / float(min(setup.camera.matrix[0, 0], setup.camera.matrix[1, 1]))
    return ViewScene(
        eye=eye,
        rotation=view.pose.rotation,
        sphere=sphere,
        height=height,
        outline=outline,
        margin=margin,
        covering=may_cover(balls, bounds, eye, margin),
        shading=may_shade(balls, bounds, light, options.lamp_angle),
        patches=patch_cones(options.white_patches, sample, view, margin),
        near=light.kind == "point",
        place=np.asarray(light.place, float),
        lamp_radius=light.radius,
        lamp_angle=options.lamp_angle,
        cos_i_min=float(np.cos(options.theta_i_max)),
        cos_r_min=float(np.cos(options.theta_r_max)),
        isotropic=isinstance(sample, Sphere) or options.isotropic,
        strength=np.asarray(view.strength, float),
        light=light,
    )


def _corners(plane: Plane) -> np.ndarray:
    return np.column_stack([plane.outline, np.full(len(plane.outline), plane.height)])


def region_of(setup: Setup, pose: Pose) -> tuple[int, int, int, int]:
    """Columns and rows [x0, x1) x [y0, y1) of the picture that hold the sample; empty if it is outside."""
    camera = setup.camera
    outline = _silhouette(setup.sample, pose)
    outline = outline[pose.apply(outline)[:, 2] > 0]
    width, height = camera.size
    if len(outline) == 0:
        return 0, 0, 0, 0
    pixels = camera.project(pose, outline)
    x0, y0 = np.floor(pixels.min(0)).astype(int)
    x1, y1 = np.ceil(pixels.max(0)).astype(int) + 1
    x0, y0, x1, y1 = max(int(x0), 0), max(int(y0), 0), min(int(x1), width), min(int(y1), height)
    return (x0, y0, x1, y1) if x0 < x1 and y0 < y1 else (0, 0, 0, 0)


def _silhouette(sample: Sphere | Plane, pose: Pose) -> np.ndarray:
    """World points along the outline as seen, (n, 3)."""
    if isinstance(sample, Plane):
        corners = _corners(sample)
        steps = np.linspace(0.0, 1.0, 32, endpoint=False)[:, None, None]
        return (corners + steps * (np.roll(corners, -1, axis=0) - corners)).reshape(-1, 3)
    axis = sample.center - pose.center
    distance = float(np.linalg.norm(axis))
    axis = axis / distance
    sine = min(sample.radius / distance, 1.0)
    u = np.linalg.svd(axis[None])[2][1:]  # two unit vectors across the axis
    angle = np.linspace(0.0, 2.0 * np.pi, 128, endpoint=False)[:, None]
    across = np.cos(angle) * u[0] + np.sin(angle) * u[1]
    # the tangent cone touches at the circle of latitude asin(R / D); 1 % more covers the chords of the
    # polygon
    return (
        sample.center - sample.radius * sine * axis + 1.01 * sample.radius * np.sqrt(1.0 - sine**2) * across
    )


def region_pixels(region: tuple[int, int, int, int]) -> np.ndarray:
    """Pixels (n, 2) of a region, row by row."""
    x0, y0, x1, y1 = region
    y, x = np.mgrid[y0:y1, x0:x1]
    return np.column_stack([x.ravel(), y.ravel()]).astype(float)


def pairs_at(scene: ViewScene, camera: Camera, pixels: np.ndarray) -> Pairs:
    """Directions seen at pixels (n, 2), and the geometric reason, if any, why one is left out."""
    rays = camera.rays(pixels) @ scene.rotation
    return pairs_along(scene, rays)


def pairs_along(scene: ViewScene, rays: np.ndarray) -> Pairs:
    """Directions seen along unit world rays (n, 3) from the eye, and the reason why one is left out."""
    depth, inner = _meet(scene, rays)
    reason = np.full(len(rays), USED, np.int8)
    point = scene.eye + depth[:, None] * rays
    normal = _normals(scene, point)
    toward, falloff = scene.light.toward(point)
    cos_i = np.einsum("ij,ij->i", normal, toward)
    cos_r = -np.einsum("ij,ij->i", normal, rays)
    with np.errstate(invalid="ignore"):
        tests = (
            ("outline", ~inner),
            ("covered", _covered(scene, rays, depth)),
            ("unlit", cos_i <= _lamp_sine(scene, falloff)),
            ("grazing", (cos_i < scene.cos_i_min) | (cos_r < scene.cos_r_min)),
            ("shadowed", _shadowed(scene, point, toward, falloff)),
        )
    for name, out in tests:
        reason[(reason == USED) & out] = LEFT_OUT.index(name)
    reason[~np.isfinite(depth)] = OUTSIDE
    if scene.isotropic:
        incident, exit_ = canonical(toward, -rays, normal)
    else:
        incident, exit_ = np.array(toward), -rays  # the tangent frame of the plane is the world's
    return Pairs(reason, point, incident, exit_, cos_i * falloff)


def canonical(toward: np.ndarray, back: np.ndarray, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs turned about the normal to the canonical incident azimuth.

    dphi keeps its sign: mirror twins lie in different places of the sample, where other stray light falls.

    ``toward`` and ``back`` are unit vectors (n, 3) to light and camera, ``normal`` (n, 3), in any one frame.
    Returns incident and exit, (n, 3), in the tangent frame.
    """
    cos_i = np.einsum("ij,ij->i", normal, toward)
    cos_r = np.einsum("ij,ij->i", normal, back)
    sin_i = np.sqrt(np.maximum(1.0 - cos_i**2, 0.0))
    sin_r = np.sqrt(np.maximum(1.0 - cos_r**2, 0.0))
    # of the exit's tangential part, along and across the incident's; the azimuth is free at normal incidence
    oblique = sin_i > 1e-9
    per = 1.0 / np.where(oblique, sin_i, 1.0)
    along = np.where(oblique, (np.einsum("ij,ij->i", toward, back) - cos_i * cos_r) * per, sin_r)
    across = np.where(oblique, np.einsum("ij,ij->i", normal, np.cross(toward, back)) * per, 0.0)
    c, s = np.cos(CANONICAL_AZIMUTH), np.sin(CANONICAL_AZIMUTH)
    incident = np.column_stack([c * sin_i, s * sin_i, cos_i])
    return incident, np.column_stack([c * along - s * across, s * along + c * across, cos_r])


def _meet(scene: ViewScene, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth (n,) along each ray at which it meets the sample (NaN: it does not), and whether well inside."""
    if scene.sphere[3] > 0.0:
        axis = scene.sphere[:3] - scene.eye
        distance2 = axis @ axis
        b = rays @ axis
        rest = b**2 - (distance2 - scene.sphere[3] ** 2)
        depth = np.where((rest > 0) & (b > 0), b - np.sqrt(np.maximum(rest, 0.0)), np.nan)
        edge = np.arcsin(scene.sphere[3] / np.sqrt(distance2)) - scene.margin
        return depth, b > np.sqrt(distance2) * np.cos(max(edge, 0.0))
    with np.errstate(divide="ignore"):
        depth = (scene.height - scene.eye[2]) / rays[:, 2]
    side = (rays @ scene.outline.T).min(1)
    return np.where((side > 0) & (depth > 0), depth, np.nan), side > np.sin(scene.margin)


def _normals(scene: ViewScene, point: np.ndarray) -> np.ndarray:
    if scene.sphere[3] > 0.0:
        return (point - scene.sphere[:3]) / scene.sphere[3]
    return np.broadcast_to(np.array([0.0, 0.0, 1.0]), point.shape)


def _covered(scene: ViewScene, rays: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """Whether a mirror ball or a white patch stands before the sample, or within the margin of it."""
    out = np.zeros(len(rays), bool)
    for ball in scene.covering:
        axis = ball[:3] - scene.eye
        distance = np.linalg.norm(axis)
        reach = np.arcsin(min(ball[3] / distance, 1.0)) + scene.margin
        out |= (rays @ axis > distance * np.cos(reach)) & (distance - ball[3] < depth)
    for height, normals in scene.patches:
        with np.errstate(divide="ignore", invalid="ignore"):
            before = (height - scene.eye[2]) / rays[:, 2] <= depth * (1.0 + 1e-9)
        out |= before & ((rays @ normals.T).min(1) > -np.sin(scene.margin))
    return out


def _lamp_sine(scene: ViewScene, falloff: np.ndarray) -> np.ndarray:
    """Sine of the lamp's angular radius at each point: below it the lamp is partly under the horizon."""
    known = scene.lamp_radius * np.sqrt(falloff) if scene.near else scene.lamp_radius * 0.0
    return np.maximum(known, np.sin(scene.lamp_angle))


def _shadowed(scene: ViewScene, point: np.ndarray, toward: np.ndarray, falloff: np.ndarray) -> np.ndarray:
    """Whether some of the lamp is hidden from each point by a mirror ball."""
    out = np.zeros(len(point), bool)
    lamp = _lamp_sine(scene, falloff)
    reach = 1.0 / np.sqrt(falloff) if scene.near else np.full(len(point), np.inf)
    for ball in scene.shading:
        offset = ball[:3] - point
        along = np.einsum("ij,ij->i", offset, toward)
        miss2 = np.einsum("ij,ij->i", offset, offset) - along**2
        out |= (along > 0) & (along - ball[3] < reach) & (miss2 < (ball[3] + lamp * along) ** 2)
    return out
