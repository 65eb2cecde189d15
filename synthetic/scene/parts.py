"""The parts of a scene and their defaults: sample, board, balls, patches, camera, lamps, sensor, faults."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import cast

import numpy as np

from photogonio.capture.photoset import Board, CharucoBoard, GridBoard, LooseMarkers
from photogonio.synthetic.scene.phone import (
    AutoExposure,
    Denoise,
    HandHeld,
    LensShading,
    LocalTone,
    NoiseFloor,
    Shade,
    Sharpen,
    ToneCurve,
)

Point = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class SampleScene:
    """The sample as the manifest says; ``offset`` is where it truly stands from there."""

    shape: str = "sphere"  # "sphere" | "plane"
    center: Point = (90.0, 70.0, 25.0)
    radius: float = 25.0
    outline: tuple[Point, ...] = ((55.0, 42.0), (125.0, 42.0), (125.0, 98.0), (55.0, 98.0))
    height: float = 0.5
    symmetry: str = "auto"
    offset: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class MarkerScene:
    """A loose marker flat on the page, its corners clockwise from the top left."""

    id: int
    corners: tuple[Point, ...]


@dataclass(frozen=True, slots=True)
class BoardScene:
    kind: str = "charuco"  # "charuco" | "aruco-grid" | "markers"
    dictionary: str = "DICT_5X5_250"
    squares: tuple[int, ...] | None = (9, 7)
    square_length: float | None = 20.0
    markers: tuple[int, ...] | None = None
    marker_length: float | None = 15.0
    marker_separation: float | None = None
    marker: tuple[MarkerScene, ...] = ()  # loose ones
    first_id: int = 0
    legacy_pattern: bool = False
    print_scale: float = 1.0  # true lengths of the print over those that the manifest gives
    curl: float = 0.0  # how far the page's left and right edges stand above its middle, length units
    paper: float = 0.82  # reflectances
    ink: float = 0.04
    table: float = 0.05
    table_radius: float = 900.0  # 0: no table

    def nominal(self) -> Board:
        """The board as the manifest gives it."""
        if self.kind == "markers":
            return LooseMarkers(
                self.dictionary, tuple((m.id, np.array(m.corners, float)) for m in self.marker)
            )
        # rules.py has seen that what a kind needs is there
        length = cast(float, self.marker_length)
        if self.kind == "charuco":
            squares, side = cast(tuple[int, int], self.squares), cast(float, self.square_length)
            return CharucoBoard(self.dictionary, squares, side, length, self.first_id, self.legacy_pattern)
        markers, apart = cast(tuple[int, int], self.markers), cast(float, self.marker_separation)
        return GridBoard(self.dictionary, markers, length, apart, self.first_id)


@dataclass(frozen=True, slots=True)
class BallScene:
    center: Point
    radius: float
    reflectance: float = 0.85


@dataclass(frozen=True, slots=True)
class PatchScene:
    outline: tuple[Point, ...]
    height: float = 0.3
    reflectance: Point = (0.9,)  # as the manifest says
    true_reflectance: Point | None = None  # where it is not so


@dataclass(frozen=True, slots=True)
class CameraScene:
    size: tuple[int, ...] = (600, 400)
    focal: float = 1350.0  # pixels
    aspect: float = 1.0  # focal length down over across
    center: Point = (6.3, -4.7)  # principal point from the middle of the picture, pixels
    distortion: Point = (-0.13, 0.09, 0.0006, -0.0004, 0.0)
    distance: Point = (620.0, 620.0)  # from the sample, least and most
    elevation: Point = (52.0, 52.0)  # degrees above the board, least and most
    azimuth: float = -90.0  # degrees from x; of the first place
    motion: str = "fixed"  # "fixed" | "moving" | "turntable"
    calibration: int = 6  # photos of the bare board
    given: bool = False  # the manifest gives matrix and distortion
    vignetting: str = "none"  # "none" | "cos4"
    defocus: float = 0.5  # standard deviation of the blur, pixels
    shading: LensShading | None = None  # beside `vignetting`; the manifest does not tell it
    hand: HandHeld | None = None  # a moving camera's places are missed


@dataclass(frozen=True, slots=True)
class LampScene:
    count: int = 12
    kind: str = "point"  # "point" | "directional"
    radius: float = 7.0  # of the glowing ball; in degrees if directional
    distance: Point = (350.0, 500.0)  # from the sample, least and most
    elevation: Point = (12.0, 85.0)  # degrees above the board, least and most
    spread: str = "around"  # "around" | "plane": all in the vertical plane of the camera
    places: tuple[Point, ...] = ()  # instead: positions (directions if directional) one by one
    color: Point = (1.0, 1.0, 1.0)
    attached_at: Point | None = None  # a lamp on the camera, in the camera's frame; one id for all photos
    attached_every: int = 1  # 2: every second photo is lit by it, the others by lamps elsewhere
    attached_given: bool = True  # the manifest gives its place
    given: bool = False  # the manifest gives places and intensities
    shade: Shade | None = None  # of lamps that stand by themselves


@dataclass(frozen=True, slots=True)
class SensorScene:
    bits: int = 16
    encoding: str = "linear"  # "linear" | "srgb" | "gamma" | "tone", which the manifest calls "unknown"
    gamma: float = 2.2
    tone: ToneCurve = field(default_factory=ToneCurve)
    local_tone: LocalTone | None = None
    denoise: Denoise | None = None
    sharpen: Sharpen | None = None
    exposure: AutoExposure | None = None
    floor: NoiseFloor | None = None
    format: str = "png"  # "png" | "tiff" | "jpeg" | "heic" | "dng" (linear)
    quality: int = 92  # of JPEG and HEIC, to 100
    chroma: str = "4:2:0"  # "4:2:0" | "4:4:4": how finely JPEG and HEIC hold colour
    primaries: str = (
        "srgb"  # "srgb" | "p3": those that a JPEG's or HEIC's profile names; the channels are theirs
    )
    level: float = 0.55  # what a 90 % white would give, facing the lamp at its mean distance
    exposure_time: float = 0.02
    f_number: float | None = None
    iso: float | None = None
    brackets: Point = ()  # factors on the exposure time: one photo each
    gain_electrons: float | None = 20000.0  # electrons at full scale; 0: no noise at all
    read_noise_electrons: float = 5.0
    declare_noise: bool = False  # the manifest gives gain and read noise
    dark_current: float = 0.0  # electrons per second
    hot_pixels: float = (
        0.0  # fraction of pixels, each with a dark current of its own up to full scale per photo
    )
    fireflies: float = 0.0  # fraction of pixels set to a random bright value, anew in each photo
    bayer: bool = False  # one colour a pixel (RGGB), the others interpolated
    black_level: float = 0.0
    ambient: float = 0.0  # the room's even light, over the lamp's on a white facing it
    dark_photos: int = 0
    ambient_photo: bool = False
    flat_photo: bool = False


@dataclass(frozen=True, slots=True)
class RenderScene:
    bounce: bool = True
    sample: int = 2  # points along a pixel's side: on the sample, beside an edge, on an edge
    near: int = 3
    edge: int = 8


@dataclass(frozen=True, slots=True)
class FaultScene:
    """What is wrong with the set, by places in its row of sample views from 0."""

    moved_after: int | None = None  # the sample stands elsewhere in all later views
    moved_by: Point = (0.0, 0.0, 0.0)
    mislabelled: tuple[tuple[int, ...], ...] = ()  # pairs: a view, and the view whose light it claims to have
    two_lamps: tuple[int, ...] = ()  # views lit by the next view's lamp too
    missing: tuple[int, ...] = ()  # views that are not there
