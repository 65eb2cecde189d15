"""The photo set's manifest, ``photoset.toml``, as frozen dataclasses.

Lengths are in the set's own unit, in the board (world) frame; angles do not occur. See docs/photoset.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

MANIFEST = "photoset.toml"


@dataclass(frozen=True, slots=True)
class CharucoBoard:
    """A chessboard with markers in its white squares."""

    kind: ClassVar[str] = "charuco"
    dictionary: str  # an OpenCV predefined dictionary's name
    squares: tuple[int, int]  # columns, rows
    square_length: float
    marker_length: float
    first_id: int = 0
    legacy_pattern: bool = False

    @property
    def pitch(self) -> float:
        """From one square to the next."""
        return float(self.square_length)

    @property
    def gap(self) -> float:
        """White between a marker and the next ink, on both sides together."""
        return self.square_length - self.marker_length


@dataclass(frozen=True, slots=True)
class GridBoard:
    """Markers in rows."""

    kind: ClassVar[str] = "aruco-grid"
    dictionary: str
    markers: tuple[int, int]  # columns, rows
    marker_length: float
    marker_separation: float
    first_id: int = 0

    @property
    def pitch(self) -> float:
        """From one marker to the next."""
        return float(self.marker_length + self.marker_separation)

    @property
    def gap(self) -> float:
        """White between two markers."""
        return self.marker_separation


@dataclass(frozen=True, slots=True)
class LooseMarkers:
    """Markers that lie anywhere."""

    kind: ClassVar[str] = "markers"
    dictionary: str
    marker_corners: tuple[tuple[int, np.ndarray], ...]  # (id, (4, 3) corners clockwise from top left)


PrintedBoard = CharucoBoard | GridBoard  # a sheet whose every point is known
Board = PrintedBoard | LooseMarkers  # around the sample


@dataclass(frozen=True, slots=True)
class Sphere:
    center: np.ndarray  # (3,)
    radius: float


@dataclass(frozen=True, slots=True)
class Plane:
    outline: np.ndarray  # (n, 2) convex polygon in board x, y
    height: float = 0.0  # board z


@dataclass(frozen=True, slots=True)
class MirrorBall:
    center: np.ndarray  # (3,)
    radius: float


@dataclass(frozen=True, slots=True)
class WhitePatch:
    outline: np.ndarray  # (n, 2) board x, y
    height: float
    reflectance: tuple[float, ...]  # one a channel, or one


@dataclass(frozen=True, slots=True)
class GreyPatch:
    """Even grey print of unknown reflectance, by which an unknown tone curve is told."""

    outline: np.ndarray  # (n, 2) board x, y
    height: float = 0.0


PAPERS = ("office", "matte-inkjet", "photo", "recycled")  # kinds whose reflectance is known, more or less


@dataclass(frozen=True, slots=True)
class Radiometry:
    encoding: str = "auto"  # "auto" (as the files say) | "linear" | "srgb" | "gamma" | "unknown"
    gamma: float | None = None
    black_level: float | None = None  # fraction of full scale; None: 0, or what a RAW file says
    white_level: float | None = None  # at and above it a pixel is saturated; None: 1, or what a RAW file says
    gain_electrons: float | None = None  # electrons at white level
    read_noise_electrons: float | None = None
    paper: str | None = (
        None  # kind that the board is printed on, one of PAPERS: the scale where no patch tells it
    )
    vignetting: str = "auto"  # "auto" (told by the board's paper) | "cos4" | "none" | "flat"
    colour: str = (
        "camera"  # of the result: "camera" | "srgb" (linear) | "xyz"; the last two take a chart photo
    )
    demosaic: str = "superpixel"  # RAW: "superpixel", or LibRaw's "linear" | "vng" | "ppg" | "ahd" | "dht"


@dataclass(frozen=True, slots=True)
class CameraEntry:
    matrix: np.ndarray | None = None  # (3, 3)
    distortion: np.ndarray | None = None  # OpenCV's order
    rotation: np.ndarray | None = None  # (3, 3), x_cam = rotation @ x + translation
    translation: np.ndarray | None = None  # (3,)
    fixed: bool = False  # it did not move relative to the board between the sample photos


@dataclass(frozen=True, slots=True)
class LightEntry:
    id: str
    kind: str | None = None  # "point" | "directional"; None: judged from the data
    position: np.ndarray | None = None  # (3,) board frame, or camera frame with attached_to
    direction: np.ndarray | None = None  # (3,) unit, toward the light
    intensity: tuple[float, ...] = (1.0,)  # relative, one a channel or one
    radius: float | None = None  # of the glowing ball
    attached_to: str | None = None  # "camera"
    marker_ids: tuple[int, ...] = ()  # markers fixed to the lamp
    markers: dict[str, object] = field(default_factory=dict)  # the rest of the entry's `markers` table


@dataclass(frozen=True, slots=True)
class Photo:
    file: str  # relative to the folder, with forward slashes
    role: str  # "calibration" | "sample" | "probe" | "dark" | "flat" | "ambient" | "chart"
    light: str | None = None  # id; None on a sample photo: the only light, or one of its own
    exposure_time: float | None = None  # seconds
    f_number: float | None = None
    iso: float | None = None
    bracket: int | None = None  # photos with the same number are one exposure series of one view
    turned: bool = False  # stored upside down against the others: read turned by half a turn


@dataclass(frozen=True, slots=True)
class View:
    """One exposure, or one bracket of exposures, of one scene under one light."""

    photos: tuple[Photo, ...]  # one, or a bracket

    @property
    def name(self) -> str:
        return self.photos[0].file

    @property
    def light(self) -> str | None:
        return self.photos[0].light


@dataclass(frozen=True, slots=True)
class PhotoSet:
    """A validated photo set; nothing but the manifest has been read."""

    folder: Path
    name: str
    length_unit: str
    sample: Sphere | Plane
    symmetry: str  # "auto" | "isotropic" | "reciprocal" | "general"
    photos: tuple[Photo, ...]
    board: Board | None = None
    mirror_balls: tuple[MirrorBall, ...] = ()
    white_patches: tuple[WhitePatch, ...] = ()
    grey_patches: tuple[GreyPatch, ...] = ()
    radiometry: Radiometry = Radiometry()
    camera: CameraEntry = CameraEntry()
    lights: tuple[LightEntry, ...] = ()

    def views(self, role: str) -> tuple[View, ...]:
        """Photos of one role in manifest order, those of one bracket joined."""
        series: dict[object, list[Photo]] = {}
        for k, photo in enumerate(self.photos):
            if photo.role == role:
                key = ("bracket", photo.bracket) if photo.bracket is not None else ("photo", k)
                series.setdefault(key, []).append(photo)
        return tuple(View(tuple(photos)) for photos in series.values())

    @property
    def turned(self) -> tuple[str, ...]:
        """Files that are read half a turn about, against how they are stored."""
        return tuple(photo.file for photo in self.photos if photo.turned)

    def turned_to(self, files: Iterable[str]) -> PhotoSet:
        """The set of which these files, and no others, are read half a turn about."""
        turned = frozenset(files)
        return replace(self, photos=tuple(replace(p, turned=p.file in turned) for p in self.photos))
