"""What a telephone does to a picture, one record an effect; a scene without the record is without the effect."""

from __future__ import annotations

from dataclasses import dataclass

# of tone curves: synthetic.render.tones
SHAPES = (
    "srgb",
    "gentle",
    "contrasty",
    "dark-pivot",
    "flat",
    "lifted",
    "shoulder",
    "strong-shoulder",
    "filmic",
    "power",
)


@dataclass(frozen=True, slots=True)
class NoiseFloor:
    """Noise of small pixels that no photon makes: rows wander as they are read, columns differ for good."""

    row_electrons: float = 3.0  # standard deviation of the rows' offsets, anew in each photo
    exponent: float = 1.0  # power over frequency^exponent from row to row: 1 is 1/f, 0 white
    column_electrons: float = 1.0  # of the columns' offsets, the same in all photos
    pixel_gain: float = 0.005  # relative, of the pixels' gains, the same in all photos


@dataclass(frozen=True, slots=True)
class LensShading:
    """Light lost toward the corners, 1 in the middle: 1 / (1 + a r^2)^2 of the distance r from the middle."""

    corner: float = 0.45  # what is left in the corners
    corrected: bool = False  # the phone divides it out again, and makes the corners' noise the larger


@dataclass(frozen=True, slots=True)
class ToneCurve:
    """One curve for all pixels, from linear light to code; `encoding` = "tone" takes it."""

    shape: str = "contrasty"  # one of SHAPES
    strength: float = 1.0  # 0: sRGB's curve; 1: the shape; between: codes in proportion


@dataclass(frozen=True, slots=True)
class LocalTone:
    """A gain by the brightness round about: (light, blurred, over its median)^-strength. No one curve undoes it."""

    strength: float = 0.3
    reach: float = 0.08  # standard deviation of the blur over the picture's diagonal


@dataclass(frozen=True, slots=True)
class Denoise:
    """A bilateral filter of the codes."""

    code: float = 0.02  # difference of codes (full scale 1) that is kept as an edge
    radius: float = 1.5  # pixels


@dataclass(frozen=True, slots=True)
class Sharpen:
    """An unsharp mask of the codes: they are moved away from their blurred selves."""

    amount: float = 0.5
    radius: float = 1.2  # pixels, standard deviation of the blur


@dataclass(frozen=True, slots=True)
class AutoExposure:
    """Each photo is as long as brings its bright parts to a level, in steps. EXIF of a JPEG or HEIC has the time by the
    name that cameras give to it (1/60 for 1/64 s), and the manifest then has none."""

    low: float = 0.5  # light of the bright parts, full scale 1, between the two, at random by photo;
    high: float = 0.8
    bright: float = 0.97  # they are this quantile of the picture
    steps: int = 3  # to the stop; 0: any time, which EXIF has as a whole part of a second (1/121)


@dataclass(frozen=True, slots=True)
class HandHeld:
    """How far the camera misses its place, standard deviations."""

    shift: float = 15.0  # length units
    aim: float = 6.0  # length units, of the point that is looked at
    roll: float = 8.0  # degrees


@dataclass(frozen=True, slots=True)
class Shade:
    """A lampshade: light leaves in a cone about the line to `aim`, and fades smoothly at its rim."""

    half_angle: float = 50.0  # degrees, where half is left
    rim: float = 10.0  # degrees, over which it fades
    aim: tuple[float, ...] = (90.0, 70.0, 0.0)
