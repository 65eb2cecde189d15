"""Where things were in every photo: the result of calibration."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.remarks import LeftOut
from photogonio.calib.rig.gaussian import RigTold
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.photoset import MirrorBall, Plane, Sphere


@dataclass(frozen=True, slots=True)
class Light:
    """One light position. ``place`` is a point in the world frame, or a unit direction toward the light."""

    id: str
    kind: str  # "point" | "directional"
    place: np.ndarray  # (3,) length units, or unit vector
    covariance: np.ndarray  # (3, 3) of place
    source: str  # "given" | "camera" | "markers" | "mirror balls" | "probe" | "refined"
    radius: float = 0.0  # of the glowing ball; 0: unknown or a point
    residual: float = float("nan")  # rms by which its highlights miss where they belong, pixels

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
class PrintTone:
    """The tone curve of photos that name none, as print and paper tell it."""

    table: np.ndarray  # (n, c) light, 1 at full scale, of evenly spaced codes from 0 to full scale
    error: np.ndarray  # (n, c) relative standard error of that against what a bright code stands for
    seen: np.ndarray  # (2,) codes, fractions of full scale, between which the print told it
    ink: np.ndarray  # (c,) black print's share of white
    misfit: float  # relative, of white print's light
    photos: int  # that told it
    scale_error: float  # relative, of the sample's light over the paper's
    surround: float = (
        0.0  # by how much white print is dimmer where it is bright round about, slope of logarithms
    )
    lamps: tuple[str, ...] = ()  # near ones, that print told with it
    places: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 3))
    )  # (l, 3); in the camera's frame if it has it
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (3 l,) * 2 of them in a row
    # (k, m, c) changes of the light's logarithm, at m evenly spaced codes from 0 to full scale, by one standard
    # deviation of each of k independent things that are not known of the curve
    doubts: np.ndarray = field(default_factory=lambda: np.zeros((0, 2, 1)))
    exposures: dict[str, float] = field(default_factory=dict)  # of views, by name: light over radiance


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
    diagnoses: tuple[Diagnosis, ...] = ()  # what the warnings tell, by code
    tone: PrintTone | None = None  # how codes stand for light, where print and paper had to tell it
    turned: tuple[str, ...] = ()  # photos that are read half a turn about, against how they are stored
    rig: tuple[RigTold, ...] = ()  # what these photos alone say of the rig; no result's file has it

    @property
    def ball(self) -> Sphere:
        """The sample, where only a ball will do. Raises TypeError for a flat one."""
        if not isinstance(self.sample, Sphere):
            raise TypeError("the sample is flat, not a ball")
        return self.sample
