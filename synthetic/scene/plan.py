"""The photos of a scene before any is rendered: where camera, lamp and sample are in each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.synthetic.scene.model import Scene

GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # azimuth step that spreads any number of places evenly
HAND_SEED = 15485863
FLASH = "flash"  # id of a lamp on the camera


@dataclass(frozen=True, slots=True)
class PlannedLamp:
    """A lamp that shines in a photo, in the world frame."""

    id: str
    kind: str  # "point" | "directional"
    place: np.ndarray  # (3,) position, or unit direction toward it
    radius: float  # length units, or radians
    intensity: np.ndarray  # (c,) radiance units x length^2, or irradiance
    shaded: bool = False  # by the scene's lampshade


@dataclass(frozen=True, slots=True)
class Shot:
    """One exposure of one view."""

    file: str
    role: str
    pose: Pose
    lamps: tuple[PlannedLamp, ...]
    exposure_time: float
    light: str | None = None  # id that the manifest gives it
    bracket: int | None = None
    offset: np.ndarray | None = None  # of the sample from where it belongs; None: it is not there
    view: int = 0  # exposures of one view have one number


def camera_of(scene: Scene) -> Camera:
    c = scene.camera
    x, y = (0.5 * (n - 1) + shift for n, shift in zip(c.size, c.center, strict=True))
    matrix = np.array([[c.focal, 0.0, x], [0.0, c.focal * c.aspect, y], [0.0, 0.0, 1.0]])
    return Camera(matrix, np.array(c.distortion, float), (int(c.size[0]), int(c.size[1])))


def look_at(eye: np.ndarray, target: np.ndarray, *, roll: float = 0.0) -> Pose:
    """Pose of a camera at ``eye`` that sees ``target`` in the middle, the board's z (its y if straight down) upward."""
    forward = (target - eye) / np.linalg.norm(target - eye)
    up = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.9999 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    cos, sin = np.cos(roll), np.sin(roll)
    rotation = np.stack([cos * right + sin * down, cos * down - sin * right, forward])
    return Pose(rotation, -rotation @ eye)


def upward(elevation: float | np.ndarray, azimuth: float | np.ndarray) -> np.ndarray:
    """Unit vectors (..., 3) at an elevation above the board and an azimuth from x, radians."""
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)


def spiral(count: int, elevation: tuple[float, ...], *, start: float = 0.0) -> np.ndarray:
    """Unit vectors (count, 3) spread evenly over a zone of elevations (degrees), from the top down."""
    low, high = np.sin(np.radians([min(elevation), max(elevation)]))
    k = np.arange(count)
    return upward(np.arcsin(high + (low - high) * (k + 0.5) / count), start + k * GOLDEN)


def distances(count: int, limits: tuple[float, ...]) -> np.ndarray:
    """(count,) values between the limits, evenly spread in any order of reading."""
    return min(limits) + (max(limits) - min(limits)) * np.mod(0.5 + np.arange(count) * 0.618034, 1.0)


def sample_center(scene: Scene) -> np.ndarray:
    """The middle of the sample as the manifest says, (3,)."""
    if scene.sample.shape == "sphere":
        return np.array(scene.sample.center, float)
    return np.array([*np.mean(scene.sample.outline, axis=0), scene.sample.height])


def camera_places(scene: Scene) -> np.ndarray:
    """Where the camera is in each view relative to the room, (n, 3)."""
    c, count, middle = scene.camera, view_count(scene), sample_center(scene)
    azimuth = np.radians(c.azimuth)
    if c.motion == "moving":
        shuffled = np.random.default_rng(scene.seed).permutation(count)
        toward = spiral(count, c.elevation, start=azimuth)[shuffled]
    else:
        toward = np.broadcast_to(upward(np.radians(np.mean(c.elevation)), azimuth), (count, 3))
    return middle + toward * distances(count, c.distance)[: 1 if c.motion != "moving" else None, None]


def view_count(scene: Scene) -> int:
    return len(scene.lamp.places) or scene.lamp.count


def camera_poses(scene: Scene) -> list[Pose]:
    """The camera's pose in each view relative to the room; a hand misses the place and what it looks at."""
    middle, places, hand = sample_center(scene), camera_places(scene), scene.camera.hand
    if hand is None:
        return [look_at(eye, middle) for eye in places]
    random = np.random.default_rng((scene.seed, HAND_SEED))
    eyes = places + hand.shift * random.standard_normal(places.shape)
    looked = middle + hand.aim * random.standard_normal(places.shape)
    rolls = np.radians(hand.roll) * random.standard_normal(len(places))
    return [look_at(eye, at, roll=roll) for eye, at, roll in zip(eyes, looked, rolls, strict=True)]


def by_attached(scene: Scene, view: int) -> bool:
    """Whether a view is lit by the lamp on the camera."""
    return scene.lamp.attached_at is not None and view % scene.lamp.attached_every == 0


def lamp_places(scene: Scene, poses: list[Pose]) -> np.ndarray:
    """Positions or directions (n, 3) of the lamp in each view, relative to the room."""
    places = loose_lamp_places(scene)
    if scene.lamp.attached_at is not None:
        held = np.stack([pose.inverse().apply(np.array(scene.lamp.attached_at)) for pose in poses])
        places = np.where([[by_attached(scene, k)] for k in range(len(poses))], held, places)
    return places


def loose_lamp_places(scene: Scene) -> np.ndarray:
    """Positions or directions (n, 3) in each view of a lamp that stands by itself."""
    lamp, count, middle = scene.lamp, view_count(scene), sample_center(scene)
    if lamp.places:
        places = np.array(lamp.places, float)
        return (
            places / np.linalg.norm(places, axis=1, keepdims=True) if lamp.kind == "directional" else places
        )
    if lamp.spread == "plane":
        swing = np.radians(np.linspace(min(lamp.elevation), 180.0 - min(lamp.elevation), count))
        toward = upward(swing, np.radians(scene.camera.azimuth))
    else:
        toward = spiral(count, lamp.elevation, start=np.radians(scene.camera.azimuth) + 0.4)
    if lamp.kind == "directional":
        return toward
    return middle + toward * distances(count, lamp.distance)[:, None]


def exposure_factor(scene: Scene) -> float:
    """Signal (full scale 1) over radiance and seconds, from ISO and f-number where the scene has them."""
    sensor = scene.sensor
    return (sensor.iso or 100.0) / 100.0 / (sensor.f_number or 1.0) ** 2


def lamp_intensity(scene: Scene) -> np.ndarray:
    """(c,): gives ``level`` on a 90 % white that faces the lamp at its mean distance."""
    sensor, lamp = scene.sensor, scene.lamp
    irradiance = sensor.level * np.pi / (0.9 * sensor.exposure_time * exposure_factor(scene))
    far = 1.0 if lamp.kind == "directional" else np.mean(lamp.distance) ** 2
    return irradiance * far * np.array(lamp.color, float)


def plan(scene: Scene) -> tuple[Shot, ...]:
    """All photos in manifest order: calibration, dark, flat, then each view with its bracket and ambient photo."""
    shots = [*calibration_shots(scene), *dark_shots(scene)]
    for k, view in enumerate(views(scene)):
        if k not in scene.fault.missing:
            shots.extend(view)
    return tuple(shots)


def views(scene: Scene) -> list[list[Shot]]:
    """The exposures of each sample view."""
    poses = camera_poses(scene)
    places = lamp_places(scene, poses)
    if scene.camera.motion == "turntable":
        poses, places = turn_table(scene, poses, places)
    radius = np.radians(scene.lamp.radius) if scene.lamp.kind == "directional" else scene.lamp.radius
    ids = [FLASH if by_attached(scene, k) else f"L{k:03d}" for k in range(len(poses))]
    strength = lamp_intensity(scene)
    kind, shade = scene.lamp.kind, scene.lamp.shade is not None
    lamps = [
        PlannedLamp(i, kind, p, radius, strength, shade and i != FLASH)
        for i, p in zip(ids, places, strict=True)
    ]
    named = list(ids)
    for view, claimed in scene.fault.mislabelled:
        named[view] = ids[claimed]
    return [view_shots(scene, k, pose, lamps, named[k]) for k, pose in enumerate(poses)]


def view_shots(scene: Scene, k: int, pose: Pose, lamps: list[PlannedLamp], named: str) -> list[Shot]:
    sensor, fault = scene.sensor, scene.fault
    lit = (lamps[k], lamps[(k + 1) % len(lamps)]) if k in fault.two_lamps else (lamps[k],)
    moved = fault.moved_after is not None and k > fault.moved_after
    offset = np.array(scene.sample.offset, float) + (np.array(fault.moved_by, float) if moved else 0.0)
    times = [factor * sensor.exposure_time for factor in sensor.brackets] or [sensor.exposure_time]
    many = len(times) > 1
    shots = [
        Shot(
            file=f"sample/s{k:03d}{f'_{n}' if many else ''}.{suffix(scene)}",
            role="sample",
            pose=pose,
            lamps=lit,
            exposure_time=time,
            light=named,
            bracket=k if many else None,
            offset=offset,
            view=k,
        )
        for n, time in enumerate(times)
    ]
    if sensor.ambient_photo and (k == 0 or scene.camera.motion != "fixed"):
        file = f"ambient/a{k:03d}.{suffix(scene)}"
        shots.append(Shot(file, "ambient", pose, (), sensor.exposure_time, offset=offset, view=10_000 + k))
    return shots


def suffix(scene: Scene) -> str:
    return {"tiff": "tif", "jpeg": "jpg"}.get(scene.sensor.format, scene.sensor.format)


def turn_table(scene: Scene, poses: list[Pose], places: np.ndarray) -> tuple[list[Pose], np.ndarray]:
    """Camera and lamp as the turning board sees them: turned back about the vertical through the sample."""
    middle = sample_center(scene)
    turned = []
    for k, (pose, place) in enumerate(zip(poses, places, strict=True)):
        angle = -2.0 * np.pi * k / len(poses)
        cos, sin = np.cos(angle), np.sin(angle)
        spin = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        board_from_room = Pose(spin, middle - spin @ middle)
        place = spin @ place if scene.lamp.kind == "directional" else board_from_room.apply(place)
        turned.append((pose @ board_from_room.inverse(), place))
    return [p for p, _ in turned], np.stack([p for _, p in turned])


def calibration_shots(scene: Scene) -> list[Shot]:
    """The bare board from several sides, under a lamp high above it."""
    count = scene.camera.calibration
    if scene.board is None or not count:
        return []
    middle = sample_center(scene) * [1.0, 1.0, 0.0]
    far = float(np.mean(scene.camera.distance))
    strength = lamp_intensity(scene)
    lamp = PlannedLamp("calibration", scene.lamp.kind, upward(1.2, 0.7), 0.0, strength)
    if scene.lamp.kind == "point":
        place = middle + upward(1.2, 0.7) * float(np.mean(scene.lamp.distance))
        lamp = PlannedLamp("calibration", "point", place, scene.lamp.radius, strength)
    shots = []
    for k, toward in enumerate(spiral(count, (48.0, 84.0), start=0.9)):
        aside = 0.04 * far * np.array([np.cos(2.4 * k), np.sin(2.4 * k), 0.0])
        eye = middle + toward * far * (1.0 + 0.12 * (k % 3) / 2.0)
        pose = look_at(eye, middle + aside, roll=0.5 * np.sin(1.7 * k))
        shots.append(
            Shot(
                f"calibration/c{k:02d}.{suffix(scene)}",
                "calibration",
                pose,
                (lamp,),
                scene.sensor.exposure_time,
                view=20_000 + k,
            )
        )
    return shots


def dark_shots(scene: Scene) -> list[Shot]:
    """Lens cap on, and an even field: neither has a lamp."""
    sensor, pose = scene.sensor, Pose(np.eye(3), np.zeros(3))
    shots = [
        Shot(f"dark/d{k}.{suffix(scene)}", "dark", pose, (), sensor.exposure_time, view=30_000 + k)
        for k in range(sensor.dark_photos)
    ]
    if sensor.flat_photo:
        shots.append(Shot(f"flat/f0.{suffix(scene)}", "flat", pose, (), sensor.exposure_time, view=40_000))
    return shots
