"""Mirror balls that are not where the manifest says, or show lamps where paper and the other balls do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.adjust.lamps import expected_pixel
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.adjust.terms import BALL_PLACE
from photogonio.calib.detect.observation import Observation
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.cones import outline
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import PhotoSet

_ASTRAY = 3.0  # expected errors of the manifest at which a ball's move is told
_CONTRADICTED = 3.0  # times their errors, by which highlights miss all lamps; path-traced sets: 0.4 to 1.2
_MISSES = 4.0  # times the other balls' residual at which a ball's highlights contradict them
_LEAST_MISS = 0.25  # pixels
_SEEN_IN = 3  # photos that hold a ball whole, at least, of which one must show a lamp in it
_SEEN_LARGE = 8  # pixels across, in which a lamp is sure to be found


class MirrorBalls(Departure):
    """Balls that settled elsewhere, or whose highlights contradict the others or the paper."""

    stage = Stage.PLACES
    entries = (
        Entry(
            "mirror-ball-moved",
            "A mirror ball seems to stand elsewhere.",
            "Check its `center` and `radius`.",
            least=_ASTRAY * BALL_PLACE,
            source="of its radius; 3 times what is expected of a manifest",
        ),
        Entry(
            "mirror-ball-contradicts",
            "A mirror ball's highlights miss the lamps that the others show.",
            "Check its `center` and `radius`, and whether it moved between photos.",
            least=_MISSES * _LEAST_MISS,
            source="pixels, or 4 times the best ball's misses where that is more",
        ),
        Entry(
            "mirror-ball-unseen",
            "A mirror ball of the manifest shows no lamp in any photo, or lies outside all of them: it tells nothing.",
            "Check its `center` and `radius`, and whether the sample hides it.",
        ),
        Entry(
            "balls-and-paper-contradict",
            "What the mirror balls show and how the paper is lit contradict each other: lights are uncertain.",
            'The lens darkens its corners: stop down, or take `flat` photos and say `vignetting = "flat"`. Or a '
            "polished ball is not where the manifest says.",
            least=_CONTRADICTED,
            source="times their errors; path-traced sets have 0.4 to 1.2",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        photoset, settled = state.photoset, state.settled
        rms = ball_misses(photoset, settled, state.observations)
        shifts = [
            settled.values[f"ball {k}"][:3] - ball.center for k, ball in enumerate(photoset.mirror_balls)
        ]
        if shifts:
            state.remarks.residuals["mirror_balls"] = [
                {"shift": shift.tolist(), "highlight_rms_px": one}
                for shift, one in zip(shifts, rms, strict=True)
            ]
            state.remarks.residuals["highlight_error_scale"] = settled.highlight_scale
        moves = [float(np.linalg.norm(shift)) for shift in shifts]
        said = [one for k in range(len(rms)) if (one := _told(photoset, k, moves[k], rms)) is not None]
        said += [one for k in range(len(rms)) if (one := _unseen(state, k)) is not None]
        return said + _beside_paper(settled.highlight_scale)


def _told(photoset: PhotoSet, number: int, moved: float, rms: Sequence[float]) -> Diagnosis | None:
    """What is amiss with one ball; None if nothing."""
    ball = photoset.mirror_balls[number]
    which = f"mirror ball {number + 1} (at {', '.join(f'{v:g}' for v in ball.center)})"
    others = [r for n, r in enumerate(rms) if n != number and np.isfinite(r)]
    detail = {"ball": number + 1}
    if moved > _ASTRAY * BALL_PLACE * ball.radius:
        message = f"{which} seems to stand {moved:.3g} {photoset.length_unit} elsewhere: check its center and radius"
        return Diagnosis("mirror-ball-moved", message, moved, detail=detail)
    if others and rms[number] > _MISSES * max(min(others), _LEAST_MISS):
        message = f"{which} contradicts the others: its highlights miss by {rms[number]:.1f} px"
        return Diagnosis("mirror-ball-contradicts", message, rms[number], detail=detail)
    return None


def _unseen(state: State, number: int) -> Diagnosis | None:
    """Of a ball in which no photo shows a lamp, though photos hold it whole, or none does; None of others."""
    ball, observations = state.photoset.mirror_balls[number], state.observations
    if not observations or any(h.ball == number for one in observations for h in one.highlights):
        return None
    camera = state.settled.camera
    limbs = [outline(camera, one.pose, ball.center, ball.radius) for one in observations]
    held = sum(is_held(limb, camera.size) for limb in limbs)
    which = f"mirror ball {number + 1} (at {', '.join(f'{v:g}' for v in ball.center)})"
    if not any(is_touched(limb, camera.size) for limb in limbs):
        message = f"{which} lies outside every photo: check its center and radius"
    elif held >= _SEEN_IN:
        message = (
            f"{which} shows no lamp in any of the {held} photos that hold it: check its center and radius"
        )
    else:
        return None
    return Diagnosis("mirror-ball-unseen", message, max(held, 1), detail={"ball": number + 1})


def is_held(limb: np.ndarray, size: tuple[int, int]) -> bool:
    """Whether a picture holds an outline (n, 2) whole, large enough to show a lamp."""
    low, high = limb.min(0), limb.max(0)
    return bool((low > 0).all() and (high < np.array(size) - 1).all() and (high - low >= _SEEN_LARGE).all())


def is_touched(limb: np.ndarray, size: tuple[int, int]) -> bool:
    """Whether any of an outline (n, 2) lies in a picture; one that is not known, behind the camera, does not."""
    low, high = limb.min(0), limb.max(0)
    return bool((high > 0).all() and (low < np.array(size) - 1).all())


def _beside_paper(scale: float) -> list[Diagnosis]:
    if scale <= _CONTRADICTED:
        return []
    message = (
        f"what the mirror balls show and how the paper is lit contradict each other, by {scale:.0f} times what their "
        "errors allow: lights are uncertain. A lens that darkens the corners does it (vignetting), and so do mirror "
        "balls that are not where the manifest says"
    )
    return [Diagnosis("balls-and-paper-contradict", message, float(scale), least=_CONTRADICTED)]


def ball_misses(photoset: PhotoSet, settled: Settled, observations: Sequence[Observation]) -> list[float]:
    """Rms (pixels) of each ball's highlights against where the lamps settled."""
    misses: list[list[float]] = [[] for _ in photoset.mirror_balls]
    for observation in observations:
        lamp = settled.lamps.get(observation.light)
        if lamp is not None:
            for h in observation.highlights:
                expected = expected_pixel(settled.camera, observation, lamp, settled.values, h.ball)
                misses[h.ball].append(float(np.sum((h.pixel - expected) ** 2)))
    return [float(np.sqrt(np.mean(m))) if m else float("nan") for m in misses]
