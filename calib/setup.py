"""Where things were in every photo: the result of calibration, and its file ``setup.json``."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path

import numpy as np
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MirrorBall, Plane, Sphere

_FORMAT = "photogonio-setup"


@dataclass(frozen=True, slots=True)
class Light:
    """One light position. ``place`` is a point in the world frame, or a unit direction toward the light."""

    id: str
    kind: str  # "point" | "directional"
    place: np.ndarray  # (3,) length units, or unit vector
    covariance: np.ndarray  # (3, 3) of place
    source: str  # "given" | "camera" | "markers" | "mirror balls" | "probe" | "refined"
    radius: float = 0.0  # of the glowing ball; 0: unknown or a point
    residual: float = float(
        "nan"
    )  # rms miss distance of the highlights' rays, length units (radians if directional)

    def toward(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors (n, 3) from world points (n, 3) to the light and 1/r^2 (n,), which is 1 if directional."""
        if self.kind == "directional":
            return np.broadcast_to(self.place, points.shape), np.ones(len(points))
        offset = self.place - points
        squared = np.einsum("ij,ij->i", offset, offset)
        return offset / np.sqrt(squared)[:, None], 1.0 / squared


@dataclass(frozen=True, slots=True)
class Marks:
    """Where things were found in one photo, pixels; for the eye."""

    corners: np.ndarray  # (n, 2) of the board, used
    corner_misses: np.ndarray  # (n, 2) where the camera sees them, less where they were found
    rejected_corners: np.ndarray  # (m, 2)
    limb: np.ndarray  # (k, 2) of the sample ball
    highlights: np.ndarray  # (j, 2) lamps in mirror balls
    expected_highlights: np.ndarray  # (i, 2) where they belong, one a ball


@dataclass(frozen=True, slots=True)
class ViewSetup:
    """One sample view: where the camera stood, which light shone, and how strongly.

    Irradiance at a point with unit normal n is ``strength * (n . toward) * falloff`` with
    ``toward, falloff = light.toward(point)``.
    """

    name: str  # the view's first file
    light: Light
    pose: Pose
    strength: np.ndarray  # (c,) radiance units x length^2 (point) or radiance units (directional)
    strength_error: np.ndarray  # (c,) standard error
    strength_source: str  # "white patch" | "board" | "intensity" | "none"
    pose_rms: float = float("nan")  # reprojection residual of the board, pixels
    pose_covariance: np.ndarray | None = None  # (6, 6) of rotation vector and translation
    marks: Marks | None = None
    veil: np.ndarray | None = None  # (c,) radiance that lies over the whole photo; None: none is known of
    veil_error: np.ndarray | None = None  # (c,) standard error


@dataclass(frozen=True, slots=True)
class BoardSetup:
    """One calibration photo: where the camera stood, and the board's corners."""

    name: str  # the view's first file
    pose: Pose
    pose_rms: float  # reprojection residual of the board, pixels
    pose_covariance: np.ndarray | None  # (6, 6) of rotation vector and translation
    marks: Marks


@dataclass(frozen=True, slots=True)
class Falloff:
    """How a lens darkens its pictures: it leaves exp(terms[0] a + terms[1] a^2) of the light at ``a`` of
    :meth:`calib.geometry.camera.Camera.aside`."""

    terms: np.ndarray  # (2,)
    covariance: np.ndarray  # (2, 2)
    allowed: bool = False  # whether it is taken out of the photos

    @property
    def corner(self) -> tuple[float, float]:
        """Change of the light in the picture's corner, relative, and its standard error."""
        left = float(np.exp(self.terms.sum()))
        return left - 1.0, left * float(np.sqrt(self.covariance.sum()))


@dataclass(frozen=True, slots=True)
class LeftOut:
    name: str  # photo
    reason: str


@dataclass(frozen=True, slots=True)
class Setup:
    """Everything calibration found."""

    camera: Camera
    sample: Sphere | Plane  # as refined
    views: tuple[ViewSetup, ...]
    scale: str  # "absolute" | "relative"
    channels: tuple[str, ...]
    left_out: tuple[LeftOut, ...] = ()
    warnings: tuple[str, ...] = ()
    residuals: dict[str, object] = field(
        default_factory=dict
    )  # what was measured on the way; plain JSON values
    source: dict[str, object] = field(default_factory=dict)  # program, command and hashes of the inputs
    mirror_balls: tuple[MirrorBall, ...] = ()  # as refined
    boards: tuple[BoardSetup, ...] = ()  # calibration photos
    ambient: np.ndarray | None = (
        None  # (c,) irradiance of level ground by light beside the lamps, as strengths have it
    )
    falloff: Falloff | None = None  # None: the manifest says, or no photo does
    scale_error: float = (
        0.0  # relative, that all strengths share by what is not known of lens, room and patches
    )

    @property
    def ball(self) -> Sphere:
        """The sample, where only a ball will do. Raises TypeError for a flat one."""
        if not isinstance(self.sample, Sphere):
            raise TypeError("the sample is flat, not a ball")
        return self.sample


def save_setup(setup: Setup, path: str | Path) -> None:
    """Write ``setup`` as JSON, whole or not at all; inverse of :func:`load_setup`."""
    path = Path(path)
    text = json.dumps({"format": _FORMAT, "version": 1} | _plain(setup), indent=1, allow_nan=False) + "\n"
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def load_setup(path: str | Path) -> Setup:
    """Read what :func:`save_setup` wrote; InputError if it is not such a file."""
    try:
        data = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(path, f"cannot be read as a setup ({error})") from error
    if not isinstance(data, dict) or data.get("format") != _FORMAT:
        raise InputError(path, f'expected "format": "{_FORMAT}"')
    try:
        return _setup(data)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(path, f"is not a whole setup ({error!r})") from error


def _plain(value: object) -> object:
    """Dataclasses, arrays and tuples as plain JSON values; NaN as null."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _array(value: list) -> np.ndarray:
    return np.array(value, dtype=float)


def _setup(data: dict) -> Setup:
    camera = data["camera"]
    return Setup(
        camera=Camera(_array(camera["matrix"]), _array(camera["distortion"]), tuple(camera["size"])),
        sample=_sample(data["sample"]),
        views=tuple(_view(v) for v in data["views"]),
        scale=data["scale"],
        channels=tuple(data["channels"]),
        left_out=tuple(LeftOut(o["name"], o["reason"]) for o in data["left_out"]),
        warnings=tuple(data["warnings"]),
        residuals=data["residuals"],
        source=data.get("source", {}),
        mirror_balls=tuple(
            MirrorBall(_array(b["center"]), float(b["radius"])) for b in data.get("mirror_balls", [])
        ),
        boards=tuple(_board(b) for b in data.get("boards", [])),
        ambient=None if data.get("ambient") is None else _array(data["ambient"]),
        falloff=None if data.get("falloff") is None else _falloff(data["falloff"]),
        scale_error=float(data.get("scale_error", 0.0)),
    )


def _sample(data: dict) -> Sphere | Plane:
    if "center" in data:
        return Sphere(_array(data["center"]), float(data["radius"]))
    return Plane(_array(data["outline"]), float(data["height"]))


def _falloff(data: dict) -> Falloff:
    return Falloff(_array(data["terms"]), _array(data["covariance"]), bool(data["allowed"]))


def _pose(data: dict) -> Pose:
    return Pose(_array(data["rotation"]), _array(data["translation"]))


def _board(data: dict) -> BoardSetup:
    covariance = None if data["pose_covariance"] is None else _array(data["pose_covariance"])
    rms = _number(data["pose_rms"])
    return BoardSetup(data["name"], _pose(data["pose"]), rms, covariance, _marks(data["marks"]))


def _marks(data: dict) -> Marks:
    return Marks(**{f.name: _array(data[f.name]).reshape(-1, 2) for f in fields(Marks)})


def _view(data: dict) -> ViewSetup:
    light = data["light"]
    return ViewSetup(
        name=data["name"],
        light=Light(
            id=light["id"],
            kind=light["kind"],
            place=_array(light["place"]),
            covariance=_array(light["covariance"]),
            source=light["source"],
            radius=float(light["radius"]),
            residual=_number(light["residual"]),
        ),
        pose=_pose(data["pose"]),
        strength=_array(data["strength"]),
        strength_error=_array(data["strength_error"]),
        strength_source=data["strength_source"],
        pose_rms=_number(data["pose_rms"]),
        pose_covariance=None if data.get("pose_covariance") is None else _array(data["pose_covariance"]),
        marks=None if data.get("marks") is None else _marks(data["marks"]),
        veil=None if data.get("veil") is None else _array(data["veil"]),
        veil_error=None if data.get("veil_error") is None else _array(data["veil_error"]),
    )
