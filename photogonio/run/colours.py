"""A BRDF in another colour space than the camera's own."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.linear.colour_chart import ColourCorrection, colour_correction, srgb_from_xyz
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.photoset import MANIFEST, PhotoSet
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.mixing import mixed

_CHANNELS = {"srgb": ("R", "G", "B"), "xyz": ("X", "Y", "Z")}
_KEY = "[radiometry] colour"


def find_correction(
    photoset: PhotoSet, radiance: RadianceReader, tell: Callable[[Diagnosis], None]
) -> ColourCorrection | None:
    """By the set's chart photos; None without any, or with a warning if none of them will do.

    Raises InputError if the manifest asks for colours that cannot be had.
    """
    asked = photoset.radiometry.colour != "camera"
    where = f"{photoset.folder / MANIFEST}: {_KEY}"
    if asked and len(radiance.channels) != 3:
        raise InputError(where, f"needs photos of 3 channels, these have {len(radiance.channels)}")
    if asked and not photoset.views("chart"):
        raise InputError(where, 'needs a photo with role "chart" that shows a 24-patch ColorChecker')
    try:
        return colour_correction(radiance)
    except InputError as error:
        if asked:
            raise
        tell(Diagnosis("chart-unusable", f"{error}: the chart is of no use, colours stay the camera's"))
        return None


def require_mixable(photoset: PhotoSet, scale: str, chosen: Sequence[str] | None) -> None:
    """Colours are mixed from all channels, their scales known. Raises InputError otherwise."""
    if photoset.radiometry.colour == "camera":
        return
    where = f"{photoset.folder / MANIFEST}: {_KEY}"
    if chosen:
        raise InputError(where, "needs all channels: leave out --channels")
    if scale != "absolute":
        what = "needs a white patch: without one the channels' scales against one another are not known"
        raise InputError(where, what)


def correction_note(found: ColourCorrection) -> dict[str, object]:
    """What is told of a correction; plain JSON values."""
    return {
        "xyz_from_camera": found.matrix.tolist(),
        "delta_e_2000_mean": float(found.delta_e.mean()),
        "delta_e_2000_max": float(found.delta_e.max()),
        "delta_e_2000_left_out_mean": float(found.delta_e_left_out.mean()),
    }


def in_colours(brdf: Brdf, to_xyz: np.ndarray, space: str) -> Brdf:
    """The BRDF in linear sRGB or XYZ, by a matrix (3, 3) from the camera's colours to XYZ; exact, since both modes and
    lobes are linear in the channels."""
    return mixed(brdf, to_xyz if space == "xyz" else srgb_from_xyz() @ to_xyz, _CHANNELS[space])
