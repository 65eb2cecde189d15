"""Lenses that darken their pictures aside of the middle (vignetting), where no flat field says so.

The same in every photo, whatever lamp shines and wherever the camera stands, so that the paper of all photos together
tells it: each photo's own lamp explains the light on the board, shadows and mirror balls hold it, and what all photos
leave alike goes with the place in the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from photogonio.calib.adjust.alternate import Settled
from photogonio.calib.adjust.terms import FALLOFF, FALLOFF_HELD
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import Falloff, ViewSetup
from photogonio.calib.shading.kernel import lens
from photogonio.capture.photoset import PhotoSet, Plane
from photogonio.capture.radiance import RadianceImage

_TERMS = slice(3, 5)  # of the lamp's block
_SURE = 6.0  # standard errors at which it is told, and
_DARK = 0.02  # of the light: how much darker the picture's corners must be
_USUAL = 0.02  # standard deviation of the terms where no photo tells


def falloff_of(settled: Settled) -> Falloff | None:
    """As the photos tell it; None where no shading does.

    While it was held about 0, where it settled gives what it would be if it were not.
    """
    if not settled.shading or settled.scene is None:
        return None
    found, covariance = settled.values["lamp"][_TERMS], settled.covariance["lamp"][_TERMS, _TERMS]
    if any(settled.scene.falloff):
        return Falloff(found, covariance, allowed=True)
    known = np.linalg.inv(covariance)
    told = known + np.diag(np.array(FALLOFF) ** -2.0 - FALLOFF_HELD**-2.0)
    if np.linalg.eigvalsh(told)[0] <= 0:
        return None
    alone = np.linalg.inv(told)
    return Falloff(alone @ known @ found, alone)


def sureness(falloff: Falloff) -> float:
    """Standard errors by which it differs from none."""
    return float(np.sqrt(falloff.terms @ np.linalg.solve(falloff.covariance, falloff.terms)))


def told(falloff: Falloff | None) -> bool:
    """Whether the lens darkens the corners by so much, and so surely, that it must be allowed for."""
    return falloff is not None and falloff.corner[0] < -_DARK and sureness(falloff) > _SURE


def fits_closer(settled: Settled, other: Settled) -> bool:
    """Whether the paper of the photos that both have is nearer to the model in the first: by what it misses, relative,
    since the errors that each expects are its own, and count what it does not believe against it."""
    both = settled.shading.keys() & other.shading.keys()
    first, second = (
        sum(one.shading[name].rms ** 2 / one.shading[name].believed for name in both)
        for one in (settled, other)
    )
    return first < second


def brighten(observations: Sequence[Observation], falloff: Falloff) -> None:
    """Let the paper of all observations be as a lens that darkens nothing would show it."""
    for observation in observations:
        reading = observation.reading
        if reading is not None:
            observation.reading = _brightened(reading, falloff.terms)


def _brightened(reading: PaperReading, terms: np.ndarray) -> PaperReading:
    samples, close = reading.samples, reading.close
    if samples.aside is None:
        return reading
    gain = 1 / lens(samples.aside, terms)
    many = gain[:, None]
    samples = replace(samples, value=samples.value * many, variance=samples.variance * many**2)
    if close is not None and close.aside is not None:
        own = 1 / lens(close.aside, terms)
        close = replace(close, level=close.level * own, noise=close.noise * own**2)
    return replace(
        reading, samples=samples, level=reading.level * gain, noise=reading.noise * gain**2, close=close
    )


def brightened_image(image: RadianceImage, camera: Camera, falloff: Falloff) -> RadianceImage:
    """A part of a photo, likewise."""
    height, width = image.valid.shape
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2)
    gain = 1 / lens(camera.aside(pixels + np.array(image.origin)), falloff.terms).reshape(height, width, 1)
    return replace(
        image,
        value=(image.value * gain).astype(image.value.dtype),
        variance=(image.variance * gain**2).astype(image.variance.dtype),
    )


def doubted(
    photoset: PhotoSet, settled: Settled, views: Sequence[ViewSetup], falloff: Falloff | None
) -> tuple[tuple[ViewSetup, ...], float]:
    """The views with what is not known of the lens in their strengths' errors, and what of it all of them share,
    relative: the sample's light was read off patches, or paper, at another place of the picture."""
    if falloff is None:
        return tuple(views), 0.0
    spread = _unknown(falloff)
    apart = np.array([_apart(photoset, settled.camera, view) for view in views])
    middle = apart.mean(0)
    own = np.sqrt(np.einsum("ni,ij,nj->n", apart - middle, spread, apart - middle))
    wider = [
        replace(view, strength_error=np.hypot(view.strength_error, error * view.strength))
        for view, error in zip(views, own, strict=True)
    ]
    return tuple(wider), float(np.sqrt(middle @ spread @ middle))


def _unknown(falloff: Falloff) -> np.ndarray:
    """Mean squares (2, 2) of what the terms may differ from those that are allowed for."""
    if falloff.allowed:
        return falloff.covariance
    known = np.linalg.inv(falloff.covariance)
    covariance = np.linalg.inv(known + np.eye(2) * _USUAL**-2.0)
    mean = covariance @ known @ falloff.terms
    return covariance + np.outer(mean, mean)


def _apart(photoset: PhotoSet, camera: Camera, view: ViewSetup) -> np.ndarray:
    """How much farther aside (and its square) the sample's middle lies in the picture than what its light was read
    off, (2,): the patches whose middles are in the picture."""
    sample, sheets = photoset.sample, photoset.white_patches
    flat = isinstance(sample, Plane)
    middle = np.append(np.mean(sample.outline, axis=0), sample.height) if flat else np.asarray(sample.center)
    read = [np.append(np.mean(sheet.outline, axis=0), sheet.height) for sheet in sheets]
    points = np.array([middle, *read], float)
    pixels = camera.project(view.pose, points)
    shown = (view.pose.apply(points)[:, 2] > 0) & (pixels >= 0).all(1) & (pixels < camera.size).all(1)
    aside = camera.aside(pixels)
    both = np.column_stack([aside, aside**2])
    return both[0] - both[1:][shown[1:]].mean(0) if shown[1:].any() else np.zeros(2)


def note_falloff(falloff: Falloff | None, remarks: Remarks) -> None:
    """What was found, and a warning if it is allowed for."""
    if falloff is None:
        return
    darker, error = falloff.corner
    remarks.residuals["lens_falloff"] = {
        "corner": darker,
        "error": error,
        "terms": falloff.terms.tolist(),
        "allowed_for": falloff.allowed,
    }
    if falloff.allowed:
        remarks.tell(
            "vignetting",
            f"the lens darkens the corners of its pictures by {-darker:.1%} (+- {error:.1%}): the paper of all photos "
            'tells it, and it is allowed for; stop down, or take flat photos and say vignetting = "flat"',
            amount=-darker,
            error=error,
            least=_DARK,
            sigmas=_SURE,
            allowed=True,
            terms=falloff.terms.tolist(),
        )
    elif told(falloff):
        remarks.tell(
            "dark-corners",
            f"the paper of all photos is darker toward the pictures' corners, by {-darker:.1%} (+- {error:.1%}), but a "
            "lens that darkens them does not explain it: not allowed for; take flat photos",
            amount=-darker,
            error=error,
            least=_DARK,
            sigmas=_SURE,
            terms=falloff.terms.tolist(),
        )
