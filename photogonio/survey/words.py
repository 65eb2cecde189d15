"""One line a photo, and what is wrong with it."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.design.spots import Spot
from photogonio.survey.checker import Checked

DARK = 0.06  # of white level: bright parts that are dimmer waste what the sensor can tell
CLIPPED = 0.02  # share of all pixels
CLIPPED_SAMPLE = 0.002  # share of the sample's
SOFT = 4.0  # pixels from a tenth to nine tenths of an edge
SOFT_SHARE = 1 / 700  # of the picture's width: what a photo of many pixels may take
ASTRAY = 1.0  # pixels rms of the board's corners
ASTRAY_SHARE = 1 / 2000  # of the picture's width
FEW = 8  # corners of the board
LITTLE = 0.03  # share of what is left open that a photo takes away: less is hardly anything new
COMPASS = ("right", "back right", "back", "back left", "left", "front left", "front", "front right")
PROBLEMS = {
    "unreadable": "cannot be read",
    "dark": "too dark: expose longer",
    "clipped": "much is clipped: expose shorter",
    "sample-clipped": "the sample is clipped: expose shorter",
    "soft": "not sharp: focus, or close the aperture",
    "smeared": "smeared one way: the camera moved",
    "no-board": "the board is not found",
    "few-corners": "little of the board is seen",
    "board-residual": "the board's corners do not fit a flat sheet",
    "no-lamp": "the lamp is not found",
    "nothing-new": "adds hardly anything new",
}


def problems(one: Checked) -> list[str]:
    """Codes of what a person should look at, of :data:`PROBLEMS`."""
    if one.fault is not None:
        return ["unreadable"]
    found, width = [], max(one.size[0], 1)
    lit = one.photo.role not in ("dark", "ambient")
    if lit and one.white < DARK:
        found.append("dark")
    if lit and one.clipped > CLIPPED:
        found.append("clipped")
    if one.clipped_sample is not None and one.clipped_sample > CLIPPED_SAMPLE:
        found.append("sample-clipped")
    if not lit or one.photo.role == "flat":
        return found
    if one.sharp is not None and one.sharp.width > max(SOFT, SOFT_SHARE * width):
        found.append("soft")
    elif one.sharp is not None and one.sharp.smeared:
        found.append("smeared")
    if not one.corners:
        return [*found, "no-board"]
    if one.corners < FEW or one.residual is None:
        return [*found, "few-corners"]
    if one.residual > max(ASTRAY, ASTRAY_SHARE * width):
        found.append("board-residual")
    if one.photo.role == "sample" and one.lamp is None:
        found.append("no-lamp")
    if one.adds is not None and one.adds < LITTLE:
        found.append("nothing-new")
    return found


def seen_line(one: Checked) -> str:
    """What there is to say of a photo whose lamp is yet to be looked for."""
    return f"{one.photo.file}: " + ", ".join(_seen(one))


def _seen(one: Checked) -> list[str]:
    parts = [one.photo.role, exposed(one)]
    if one.sharp is not None:
        parts.append(f"edges {one.sharp.width:.1f} px")
    parts.append(board_words(one))
    if one.camera is not None:
        parts.append(f"camera {where(one.camera)}")
    return parts


def line(one: Checked, said: bool = False) -> str:
    """What there is to say of a photo; without what :func:`seen_line` ``said`` of it."""
    if one.fault is not None:
        why = one.fault.removeprefix(f"{PROBLEMS['unreadable']}: ")
        return f"{one.photo.file}: {PROBLEMS['unreadable']} ({why})"
    parts = [] if said else _seen(one)
    if one.photo.role == "sample":
        parts.append(lamp_words(one))
    if one.adds is not None:
        parts.append(f"adds {100 * one.adds:.0f} %")
    wrong = [PROBLEMS[code] for code in problems(one)]
    return f"{one.photo.file}: " + ", ".join(parts) + (f" - {'; '.join(wrong)}" if wrong else "")


def exposed(one: Checked) -> str:
    """Brightness and clipping."""
    text = f"white at {100 * one.white:.0f} %"
    if one.clipped_sample is not None:
        return f"{text}, {share(one.clipped_sample)} of the sample clipped"
    return f"{text}, {share(one.clipped)} clipped"


def share(part: float) -> str:
    return "nothing" if part == 0.0 else f"{100 * part:.2g} %" if part >= 1e-4 else "below 0.01 %"


def board_words(one: Checked) -> str:
    if not one.corners:
        return "no board"
    residual = "" if one.residual is None else f", {one.residual:.2f} px off"
    return f"board {one.corners} corners{residual}"


def lamp_words(one: Checked) -> str:
    if one.lamp is None or one.shot is None:
        return "lamp not found"
    if one.lamp.attached:
        return "flash on the camera"
    return f"lamp {where(one.shot.lamp)} (by {one.lamp.source})"


def where(spot: Spot) -> str:
    """A place in degrees, and in words of somebody who stands where the board is upright."""
    side = COMPASS[round(spot.azimuth / 45.0) % 8]
    return f"{spot.elevation:.0f} degrees up, {round(spot.azimuth)} about ({side})"


def numbers(one: Checked) -> dict[str, object]:
    """For ``--json``."""
    codes = problems(one)
    found: dict[str, object] = {"photo": one.photo.file, "role": one.photo.role, "problems": codes}
    if one.fault is not None:
        return found | {"fault": one.fault}
    found |= {
        "size": one.size,
        "exposure_time": one.exposure.exposure_time,
        "f_number": one.exposure.f_number,
        "iso": one.exposure.iso,
        "flash": one.flash,
        "white": one.white,
        "clipped": one.clipped,
        "clipped_sample": one.clipped_sample,
        "edge_width_px": None if one.sharp is None else one.sharp.width,
        "board_corners": one.corners or 0,
        "board_residual_px": one.residual,
        "camera": spot_numbers(one.camera),
        "lamp": None if one.shot is None else spot_numbers(one.shot.lamp),
        "lamp_source": None if one.lamp is None else one.lamp.source,
        "adds": one.adds,
    }
    return found


def spot_numbers(spot: Spot | None) -> dict[str, float] | None:
    """Degrees above the board and about its normal from x, and the distance from the sample's middle."""
    if spot is None:
        return None
    numbers = {"elevation": spot.elevation, "azimuth": spot.azimuth, "distance": spot.distance}
    return {name: float(np.round(value, 2)) for name, value in numbers.items()}
