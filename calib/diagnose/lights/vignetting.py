"""Lenses that darken their pictures aside of the middle (vignetting), where no flat field says so.

The same in every photo, whatever lamp shines and wherever the camera stands, so that the paper of all photos together
tells it: each photo's own lamp explains the light on the board, shadows and mirror balls hold it, and what all photos
leave alike goes with the place in the picture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.adjust.terms import FALLOFF, FALLOFF_HELD
from photogonio.calib.diagnose.base import NO_DOUBT, Doubt, LightDeparture
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.setup import Falloff, ViewSetup
from photogonio.calib.shading.correction import PhotometricCorrection
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import PhotoSet, Plane

_TERMS = slice(3, 5)  # of the lamp's block
_SURE = 6.0  # standard errors at which it is told, and
_DARK = 0.02  # of the light: how much darker the picture's corners must be
_USUAL = 0.02  # standard deviation of the terms where no photo tells


class Vignetting(LightDeparture):
    """A lens that darkens its pictures, kept if that explains the paper better."""

    code = "vignetting"
    certain = False
    entries = (
        Entry(
            "vignetting",
            "The lens darkens the corners of its pictures. The paper of all photos together tells it, and "
            "it is divided "
            "out.",
            "Photos of an even field (role `flat`) tell it better, also where no board is; stop down.",
            least=0.02,
            sigmas=6.0,
            source="of the light in the corners; path-traced sets in order have at most 0.0024, and drawn ones, which "
            "show less paper, 2.8 standard errors",
        ),
        Entry(
            "dark-corners",
            "The paper is darker toward the pictures' corners, but a lens that darkens them does not explain it: it is "
            "not allowed for.",
            'Take photos of an even field and say `vignetting = "flat"`.',
            least=0.02,
            sigmas=6.0,
            source="as for vignetting",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        falloff = falloff_known(state)
        if falloff is None:
            return []
        darker, error = falloff.corner
        sure = sureness(falloff)
        # both terms together are surer than what they make of the corner
        return [
            Diagnosis(
                self.code,
                amount=-darker,
                error=abs(darker) / sure if sure > 0 else error,
                least=_DARK,
                sigmas=_SURE,
                detail={"terms": falloff.terms.tolist(), "corner_error": error},
                grounds=falloff,
            )
        ]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        first, second = found[0].grounds.terms.tolist()
        return replace(state, falloff=(first, second))

    def as_settled(self, state: State, found: Diagnosis) -> Diagnosis:
        (now,) = self.evidence(state) or (found,)
        return replace(now, allowed=found.allowed)

    def numbers(self, found: Diagnosis) -> dict[str, object]:
        return {
            "lens_falloff": {
                "corner": -found.amount,
                "error": found.detail["corner_error"],
                "terms": found.detail["terms"],
                "allowed_for": found.allowed,
            }
        }

    def doubt(self, state: State, views: Sequence[ViewSetup]) -> Doubt:
        return lens_doubt(state.photoset, state.settled.camera, views, falloff_known(state))

    def message(self, found: Diagnosis, *, allowed: bool) -> str:
        how = f"by {found.amount:.1%} (+- {found.detail['corner_error']:.1%})"
        if allowed:
            return (
                f"the lens darkens the corners of its pictures {how}: the paper of all photos tells it, and it is "
                'allowed for; stop down, or take flat photos and say vignetting = "flat"'
            )
        if found.told:
            return (
                f"the paper of all photos is darker toward the pictures' corners, {how}, but a lens that darkens them "
                "does not explain it: not allowed for; take flat photos"
            )
        return ""

    def told_as(self, found: Diagnosis) -> str:
        return self.code if found.allowed else "dark-corners"


def falloff_known(state: State) -> Falloff | None:
    """What is known of the lens where the manifest leaves it to the photos."""
    return falloff_of(state.settled) if state.photoset.radiometry.vignetting == "auto" else None


def present_falloff(state: State) -> tuple[float, float]:
    """The terms as they settled, where a lens is allowed for."""
    if not any(state.falloff):
        return state.falloff
    first, second = state.settled.values["lamp"][_TERMS].tolist()
    return first, second


def corrected(state: State) -> State:
    """All photos' paper as a lens that darkens nothing would show it, if it is known to darken them."""
    if not any(state.falloff):
        return state
    lens = PhotometricCorrection(falloff=present_falloff(state))
    names = [one.view.name for one in state.observations]
    corrections = {name: replace(state.correction(name), falloff=lens.falloff) for name in names}
    return replace(state.with_paper(lambda _, reading: lens.of_reading(reading)), corrections=corrections)


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


def lens_doubt(
    photoset: PhotoSet, camera: Camera, views: Sequence[ViewSetup], falloff: Falloff | None
) -> Doubt:
    """What is not known of the lens in the views' strengths: the sample's light was read off patches, or paper, at
    another place of the picture."""
    if falloff is None:
        return NO_DOUBT
    spread = _unknown(falloff)
    apart = np.array([_apart(photoset, camera, view) for view in views])
    middle = apart.mean(0)
    own = np.sqrt(np.einsum("ni,ij,nj->n", apart - middle, spread, apart - middle))
    return Doubt(own, float(np.sqrt(middle @ spread @ middle)))


def _unknown(falloff: Falloff) -> np.ndarray:
    """Mean squares (2, 2) of what the terms may differ from those that are allowed for.

    A lens that darkens its pictures as usual and one that does not (which stands in the middle of its circle, or whose
    camera makes up for it) are as likely before the paper tells.
    """
    if falloff.allowed:
        return falloff.covariance
    usual = np.eye(2) * _USUAL**2
    gain = usual @ np.linalg.inv(usual + falloff.covariance)
    mean = gain @ falloff.terms
    odds = _log_density(falloff.terms, falloff.covariance + usual) - _log_density(
        falloff.terms, falloff.covariance
    )
    return (usual - gain @ usual + np.outer(mean, mean)) / (1.0 + np.exp(-odds))


def _log_density(value: np.ndarray, covariance: np.ndarray) -> float:
    """Of a normal distribution about 0, up to a constant."""
    return float(-0.5 * (value @ np.linalg.solve(covariance, value) + np.linalg.slogdet(covariance)[1]))


def _apart(photoset: PhotoSet, camera: Camera, view: ViewSetup) -> np.ndarray:
    """How much farther aside (and its square) the sample's middle lies in the picture than what its light was read
    off, (2,): the patches whose middles are in the picture."""
    sample, sheets = photoset.sample, photoset.white_patches
    if isinstance(sample, Plane):
        middle = np.append(np.mean(sample.outline, axis=0), sample.height)
    else:
        middle = np.asarray(sample.center)
    read = [np.append(np.mean(sheet.outline, axis=0), sheet.height) for sheet in sheets]
    points = np.array([middle, *read], float)
    pixels = camera.project(view.pose, points)
    shown = (view.pose.apply(points)[:, 2] > 0) & (pixels >= 0).all(1) & (pixels < camera.size).all(1)
    aside = camera.aside(pixels)
    both = np.column_stack([aside, aside**2])
    return both[0] - both[1:][shown[1:]].mean(0) if shown[1:].any() else np.zeros(2)
