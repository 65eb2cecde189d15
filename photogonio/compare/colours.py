"""Colours of BRDFs: linear sRGB, CIE X, Y and Z, or a luminance alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.compare.known import Known
from photogonio.reconstruct.brdf.merl import CHANNELS
from photogonio.reconstruct.export.pabopto_files import XYZ_OF_RGB
from photogonio.synthetic.brdf.measured import Read
from photogonio.synthetic.brdf.reflectance import Reflectance

XYZ = ("X", "Y", "Z")


def in_common_colours(a: Known, b: Known) -> tuple[Known, Known]:
    """X, Y and Z as linear sRGB beside R, G and B; R, G and B as their CIE Y beside a luminance. Others as they are."""
    return _like(a, b), _like(b, a)


def in_rgb(known: Known) -> Known:
    """X, Y and Z as linear sRGB; others as they are."""
    if set(known.channels) == set(XYZ):
        return _mixed(known, XYZ, np.linalg.inv(XYZ_OF_RGB), CHANNELS)
    return known


def rendered(known: Known) -> Reflectance:
    """As a renderer of pictures takes it.

    Raises:
        InputError: it is known at single pairs of directions only.
    """
    known = in_rgb(known)
    if known.evaluate is None:
        raise InputError(known.name, "is known at single pairs of directions only; fit it first")
    return Read(known.evaluate, known.isotropic)


def _like(one: Known, other: Known) -> Known:
    if set(other.channels) == set(CHANNELS):
        return in_rgb(one)
    if set(one.channels) == set(CHANNELS) and other.luminance and other.channels == ("Y",):
        return _mixed(one, CHANNELS, XYZ_OF_RGB[1:2], ("Y",))
    return one


def _mixed(known: Known, order: tuple[str, ...], matrix: np.ndarray, names: tuple[str, ...]) -> Known:
    """With the channels ``names``, which are ``matrix`` times those in ``order``."""
    taken = [known.channels.index(name) for name in order]
    whole = known.evaluate
    return replace(
        known,
        channels=names,
        evaluate=None if whole is None else lambda i, r: whole(i, r)[..., taken] @ matrix.T,
        value=None if known.value is None else known.value[:, taken] @ matrix.T,
    )
