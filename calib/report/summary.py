"""What a calibration found, with its errors, and what in it looks wrong."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.calib.adjust.bundle import pose_block, project
from photogonio.calib.adjust.flat_sample import PlaneMove
from photogonio.calib.adjust.lamps import expected_pixel
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.adjust.terms import BALL_PLACE, SAMPLE_PLACE
from photogonio.calib.detect.observation import Observation
from photogonio.calib.diagnose.photos.moved_lamp import SHARED_APART, SURE_APART, aside
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import Marks
from photogonio.capture.photoset import PhotoSet, Plane, Sphere

_BALL_ASTRAY = 3.0  # expected errors of the manifest at which a ball's move is told
_IMPLAUSIBLE = 4.0  # the same at which a sample ball's is not believed
_TILTED = np.radians(0.7)
_SURE_TILT = 5.0  # standard errors at which a tilt is told
_CONTRADICTED = 3.0  # times their errors, by which highlights miss all lamps; path-traced sets: 0.4 to 1.2
_BALL_MISSES = 4.0  # times the other balls' residual at which a ball's highlights contradict them


def account(state: State) -> None:
    """Fill in residuals, standard errors and warnings."""
    photoset, settled = state.photoset, state.settled
    observations, remarks = state.observations, state.remarks
    _camera(settled, remarks)
    _sample(photoset, settled, remarks)
    _balls(photoset, settled, observations, remarks)
    remarks.residuals["corner_residual_sigmas"] = settled.corner_rms
    lonely = [lamp.name for lamp in settled.lamps.values() if lamp.one_ray and lamp.kind == "point"]
    if lonely:
        remarks.tell(
            "one-mirror-ball",
            f"seen in one mirror ball only, so put as far away as the other lights: {', '.join(lonely)}",
            amount=len(lonely),
        )
    _shared_lights(settled, observations, remarks)
    if settled.scene is not None and settled.shading:
        error = float(np.sqrt(settled.covariance["lamp"][0, 0])) * settled.scene.lamp_radius
        remarks.residuals["lamp_radius"] = settled.scene.lamp_radius
        remarks.residuals["lamp_radius_error"] = error
        rms = [f.rms for f in settled.shading.values()]
        remarks.residuals["shading_rms"] = float(np.median(rms))


def _shared_lights(settled: Settled, observations: Sequence[Observation], remarks: Remarks) -> None:
    """Lights that stood in several places under one name: each photo's paper tells its own, if it shows enough."""
    for lamp in settled.lamps.values():
        names = tuple(
            s.view.name for s in observations if s.light == lamp.name and s.view.name in settled.shading
        )
        fits = [settled.shading[name] for name in names]
        if lamp.attached or len(fits) < 2:
            continue
        toward = np.array([fit.place / np.linalg.norm(fit.place) for fit in fits])
        apart = np.linalg.norm(toward - np.median(toward, axis=0), axis=1)
        errors = np.array([aside(fit) for fit in fits])
        sure = apart > SURE_APART * errors
        worst = apart[sure].max(initial=0.0)
        if worst > SHARED_APART:
            remarks.tell(
                "lamp-in-several-places",
                f"photos of light {lamp.name!r} show it in directions {np.degrees(worst):.0f} degrees apart: give each "
                "place of a lamp an id of its own",
                amount=float(worst),
                error=float(errors.max()),
                sigmas=SURE_APART,
                least=float(SHARED_APART),
                views=names,
            )


def _camera(settled: Settled, remarks: Remarks) -> None:
    covariance = settled.covariance.get("camera")
    if covariance is None:
        return
    told = remarks.residuals.setdefault("camera", {})
    if isinstance(told, dict):
        names = ["fx", "fy", "cx", "cy", *(f"distortion[{k}]" for k in settled.model.free)]
        told["standard_errors"] = dict(zip(names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        told["corner_error_px"] = corner_error(settled, covariance)


def corner_error(settled: Settled, covariance: np.ndarray) -> float:
    """Standard error, pixels, of where a far point at the picture's corner is projected."""
    camera = settled.camera
    ray = camera.rays(np.array([[0.0, 0.0]]))
    _, _, by_camera, _ = project(
        settled.model, settled.values["camera"], pose_block(Pose(np.eye(3), np.zeros(3))), ray
    )
    spread = by_camera[0] @ covariance @ by_camera[0].T
    return float(np.sqrt(np.trace(spread) / 2))


def _sample(photoset: PhotoSet, settled: Settled, remarks: Remarks) -> None:
    sample = photoset.sample
    if not isinstance(sample, Sphere) or "sample" not in settled.values:
        return
    block = settled.values["sample"]
    shift = block[:3] - sample.center
    error = np.sqrt(np.diag(settled.covariance["sample"]))
    remarks.residuals["sample"] = {
        "shift": shift.tolist(),
        "shift_error": error[:3].tolist(),
        "radius_change": float(block[3] - sample.radius),
        "radius_error": float(error[3]),
    }
    moved = float(np.linalg.norm(shift))
    if not believed(photoset, settled):
        remarks.tell(
            "sample-not-believed",
            f"the sample ball seems to stand {moved:.3g} {photoset.length_unit} off the manifest's center: "
            "not believed, the manifest's is kept; check sample.center, sample.radius, and with a ruler whether the "
            "board's squares are as long as the manifest says",
            amount=moved,
        )
    elif moved > SAMPLE_PLACE * sample.radius:
        remarks.tell(
            "sample-moved",
            f"the sample ball stands {moved:.3g} {photoset.length_unit} off the manifest's center; this is allowed for",
            amount=moved,
            allowed=True,
        )


def account_plane(photoset: PhotoSet, move: PlaneMove | None, remarks: Remarks) -> None:
    """How a flat sample lies, and what of it a person should look at."""
    if move is None:
        return
    x, y, turn, height, *slopes, wider, deeper = move.values.tolist()
    error = move.errors.tolist()
    remarks.residuals["sample"] = {
        "shift": [x, y, height],
        "shift_error": [error[0], error[1], error[3]],
        "turn": turn,
        "turn_error": error[2],
        "tilt": slopes,
        "tilt_error": error[4:6],
        "growth": [wider, deeper],
        "growth_error": error[6:],
    }
    if not move.plausible:
        remarks.tell(
            "flat-sample-not-believed",
            "the flat sample's edges are not where the manifest puts them: not believed, the manifest's are kept; "
            "check sample.outline and sample.height",
        )
        return
    tilt, sure = move.tilt
    if tilt > max(_SURE_TILT * sure, _TILTED):
        remarks.tell(
            "flat-sample-tilted",
            f"the flat sample is tilted by {np.degrees(tilt):.1f} degrees against the board, "
            "and is taken as level: lay it flat",
            amount=tilt,
            error=sure,
            least=float(_TILTED),
            sigmas=_SURE_TILT,
        )
    far = np.abs(move.values[:4]) > np.maximum(_SURE_TILT * move.errors[:4], move.expected[:4])
    if far.any():
        unit = photoset.length_unit
        remarks.tell(
            "flat-sample-moved",
            f"the flat sample lies {x:+.2g}, {y:+.2g} {unit} beside its outline and {height:+.2g} {unit} higher "
            "than in the manifest; this is allowed for",
            allowed=True,
            shift=[x, y, height],
        )
    grown = np.abs(move.values[6:]) > np.maximum(_SURE_TILT * move.errors[6:], move.expected[6:])
    if grown.any():
        remarks.tell(
            "flat-sample-size",
            f"the flat sample is {wider:+.1%} larger along x and {deeper:+.1%} along y than its outline in the "
            "manifest; this is allowed for",
            allowed=True,
            growth=[wider, deeper],
        )


def believed(photoset: PhotoSet, settled: Settled) -> bool:
    """Whether the refined sample is plausible."""
    sample = photoset.sample
    if isinstance(sample, Plane) or "sample" not in settled.values:
        return False
    block = settled.values["sample"]
    off = float(np.linalg.norm(block[:3] - sample.center)) / sample.radius
    return off < _IMPLAUSIBLE * SAMPLE_PLACE and abs(block[3] / sample.radius - 1) < SAMPLE_PLACE


def _balls(
    photoset: PhotoSet, settled: Settled, observations: Sequence[Observation], remarks: Remarks
) -> None:
    told: list[dict[str, object]] = []
    rms = _ball_misses(photoset, settled, observations)
    for k, ball in enumerate(photoset.mirror_balls):
        shift = settled.values[f"ball {k}"][:3] - ball.center
        others = [r for n, r in enumerate(rms) if n != k and np.isfinite(r)]
        told.append({"shift": shift.tolist(), "highlight_rms_px": rms[k]})
        place = ", ".join(f"{v:g}" for v in ball.center)
        moved = float(np.linalg.norm(shift))
        if moved > _BALL_ASTRAY * BALL_PLACE * ball.radius:
            remarks.tell(
                "mirror-ball-moved",
                f"mirror ball {k + 1} (at {place}) seems to stand {moved:.3g} {photoset.length_unit} elsewhere: "
                "check its center and radius",
                amount=moved,
                ball=k + 1,
            )
        elif others and rms[k] > _BALL_MISSES * max(min(others), 0.25):
            remarks.tell(
                "mirror-ball-contradicts",
                f"mirror ball {k + 1} (at {place}) contradicts the others: its highlights miss by {rms[k]:.1f} px",
                amount=rms[k],
                ball=k + 1,
            )
    if settled.highlight_scale > _CONTRADICTED:
        remarks.tell(
            "balls-and-paper-contradict",
            "what the mirror balls show and how the paper is lit contradict each other, by "
            f"{settled.highlight_scale:.0f} times what their errors allow: lights are uncertain. A lens that darkens "
            "the corners does it (vignetting), and so do mirror balls that are not where the manifest says",
            amount=float(settled.highlight_scale),
            least=_CONTRADICTED,
        )
    if told:
        remarks.residuals["mirror_balls"] = told
        remarks.residuals["highlight_error_scale"] = settled.highlight_scale


def _ball_misses(photoset: PhotoSet, settled: Settled, observations: Sequence[Observation]) -> list[float]:
    """Rms (pixels) of each ball's highlights against where the lamps settled."""
    misses: list[list[float]] = [[] for _ in photoset.mirror_balls]
    for observation in observations:
        lamp = settled.lamps.get(observation.light)
        if lamp is not None:
            for h in observation.highlights:
                expected = expected_pixel(settled.camera, observation, lamp, settled.values, h.ball)
                misses[h.ball].append(float(np.sum((h.pixel - expected) ** 2)))
    return [float(np.sqrt(np.mean(m))) if m else float("nan") for m in misses]


def marks(photoset: PhotoSet, settled: Settled, observation: Observation) -> Marks:
    """What was found in one photo, for the eye."""
    empty = np.zeros((0, 2))
    corners, misses = empty, empty
    if observation.corners is not None:
        corners = observation.corners.pixels
        misses = settled.camera.project(observation.pose, observation.corners.points) - corners
    lamp = settled.lamps.get(observation.light)
    expected = [
        expected_pixel(settled.camera, observation, lamp, settled.values, k)
        for k in range(len(photoset.mirror_balls))
        if lamp is not None
    ]
    return Marks(
        corners,
        misses,
        observation.rejected,
        empty if observation.limb is None else observation.limb.pixels,
        np.array([h.pixel for h in observation.highlights]).reshape(-1, 2),
        np.array([e for e in expected if np.isfinite(e).all()]).reshape(-1, 2),
    )


def board_marks(settled: Settled, corners: Corners, pose: Pose) -> Marks:
    """The board's corners in one calibration photo."""
    empty = np.zeros((0, 2))
    misses = settled.camera.project(pose, corners.points) - corners.pixels
    return Marks(corners.pixels, misses, empty, empty, empty, empty)
