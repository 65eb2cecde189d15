"""Is the calibration to be trusted? What a user can do something about, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.calib.adjust.bundle import Derivatives, Term, Values, adjust, prior_term
from photogonio.calib.adjust.camera_model import CameraModel, camera_term, pose_block, project
from photogonio.calib.adjust.sightings import corner_term
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import FIXED_POSE, Posed
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.diagnosis import Diagnosis, Entry

_FEW_PHOTOS = 4
_FRONTAL = 12.0  # degrees: photos tilted less tell little of the focal length
_ALIKE = 12.0  # degrees within which board normals are one and the same
_OUTER = 2 / 3  # of the way from the middle to the picture's corner
_BAD_PHOTO = 3.0  # times the typical residual
_BAD_PIXELS = 0.3  # residual below which no photo is bad
_SURE = 6.0  # standard errors at which a shape of the board is believed
_BENT = 0.002  # of the board's size
_STRETCHED = 0.002  # relative


def bad_photos(camera: Camera, boards: Sequence[Posed]) -> list[tuple[int, str]]:
    """Photos whose corners fit much worse than the others', with the reason."""
    rms = np.array([_rms(camera, corners, pose) for _, corners, pose in boards])
    if len(rms) < _FEW_PHOTOS:
        return []
    bound = max(_BAD_PHOTO * float(np.median(rms)), _BAD_PIXELS)
    return [
        (k, f"its corners miss by {r:.2f} px, the others' by {np.median(rms):.2f} px")
        for k, r in enumerate(rms)
        if r > bound
    ]


def _rms(camera: Camera, corners: Corners, pose: Pose) -> float:
    miss = camera.project(pose, corners.points) - corners.pixels
    return float(np.sqrt(np.mean((miss**2).sum(1))))


def views_told(size: tuple[int, int], boards: Sequence[Posed]) -> list[Diagnosis]:
    """What the choice of photos leaves undetermined."""
    if not boards:
        return []
    said = []
    normals = np.array([pose.rotation[:, 2] for _, _, pose in boards])
    tilt = np.degrees(np.arccos(np.clip(-normals[:, 2], -1, 1)))
    middle = normals.mean(0) / np.linalg.norm(normals.mean(0))
    apart = np.degrees(np.arccos(np.clip(normals @ middle, -1, 1)))
    if len(boards) < _FEW_PHOTOS:
        said.append(
            Diagnosis(
                "few-camera-photos",
                f"only {len(boards)} photos tell the camera: take eight or more of the board",
                amount=len(boards),
            )
        )
    if tilt.max() < _FRONTAL:
        said.append(
            Diagnosis(
                "frontal-photos",
                f"all photos are frontal (tilt at most {tilt.max():.0f} degrees): tilt the board by 30 to 45 degrees",
            )
        )
    elif apart.max() < _ALIKE:
        said.append(
            Diagnosis(
                "tilted-alike", "the board is tilted alike in all photos: tilt it in different directions"
            )
        )
    reach = np.array(size, float) / 2
    pixels = np.concatenate([corners.pixels for _, corners, _ in boards])
    outward = np.linalg.norm((pixels - reach) / reach, axis=1) / np.sqrt(2)
    if outward.max() < _OUTER:
        said.append(
            Diagnosis(
                "corners-in-middle",
                "no corner in the outer third of the picture: its distortion there is a guess",
            )
        )
    return said


@dataclass(frozen=True, slots=True)
class BoardShape:
    """How the print departs from a flat one of the stated proportions, with standard errors."""

    stretch: float  # of y over x, relative
    stretch_error: float
    bend: np.ndarray  # (3,) sagitta over half the board, in its sizes, along x, y and the diagonal
    bend_error: np.ndarray

    def told(self) -> list[Diagnosis]:
        """In words, where it is sure and matters."""
        said = []
        if abs(self.stretch) > max(_SURE * self.stretch_error, _STRETCHED):
            longer = "taller" if self.stretch > 0 else "wider"
            said.append(
                Diagnosis(
                    "board-stretched",
                    f"the board is {100 * abs(self.stretch):.2f} % {longer} than the manifest says: printed with "
                    "unequal scales, or square_length is wrong in one direction",
                    amount=abs(self.stretch),
                    error=self.stretch_error,
                    least=_STRETCHED,
                    sigmas=_SURE,
                )
            )
        worst = int(np.argmax(np.abs(self.bend) / np.maximum(self.bend_error, 1e-12)))
        if abs(self.bend[worst]) > max(_SURE * self.bend_error[worst], _BENT):
            said.append(
                Diagnosis(
                    "board-bent",
                    f"the board is not flat (bent by {100 * abs(self.bend[worst]):.1f} % of its size): fix "
                    f"it to a plate",
                    amount=float(abs(self.bend[worst])),
                    error=float(self.bend_error[worst]),
                    least=_BENT,
                    sigmas=_SURE,
                )
            )
        return said


def board_shape(
    model: CameraModel, camera: Camera, boards: Sequence[Posed], fixed_camera: bool
) -> BoardShape | None:
    """Stretch and bending of the print, adjusted together with camera and poses; None from too few corners."""
    if len(boards) < 3 or sum(len(c) for _, c, _ in boards) < 60:
        return None
    every = np.concatenate([c.points for _, c, _ in boards])
    if np.ptp(every[:, 2]) > 0:
        return None
    middle = (every.min(0) + every.max(0)) / 2
    half = float(np.ptp(every[:, :2], axis=0).max()) / 2
    values: Values = {"camera": model.block(camera), "shape": np.zeros(4)}
    values |= {name: pose_block(pose) for name, _, pose in boards}
    terms = [(_shaped(model, name, c, middle, half), True) for name, c, _ in boards]
    terms.append((camera_term(model), False))
    terms.append((prior_term("shape", np.zeros(4), np.full(4, 0.05)), False))
    done = adjust(values, terms, frozenset({"camera"} if fixed_camera else ()))
    z = np.concatenate(done.residuals[: len(boards)])
    error = np.sqrt(np.diag(done.covariance["shape"])) * max(
        1.0, float(np.sqrt(np.mean(np.minimum(z**2, 9))))
    )
    shape = done.values["shape"]
    return BoardShape(float(shape[0]), float(error[0]), shape[1:], error[1:])


def _shaped(model: CameraModel, pose_name: str, corners: Corners, middle: np.ndarray, half: float) -> Term:
    """Corners of a board stretched in y by ``shape[0]`` and bent by ``shape[1:]`` halves along x, y and across."""
    u, v = ((corners.points - middle) / half)[:, :2].T
    by_stretch = np.column_stack([np.zeros(len(u)), corners.points[:, 1] - middle[1], np.zeros(len(u))])
    bends = np.stack([u**2, v**2, u * v], axis=1) * half
    plain = corner_term(model, pose_name, corners)

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        shape = values["shape"]
        moved = corners.points + by_stretch * shape[0]
        moved[:, 2] += bends @ shape[1:]
        weight = np.repeat(1 / corners.sigma, 2)
        pixels, _, _, by_point = project(model, values["camera"], values[pose_name], moved)
        _, derivatives = plain(values)
        columns = [np.einsum("nij,nj->ni", by_point, by_stretch).ravel()]
        columns += [(by_point[:, :, 2] * bends[:, k : k + 1]).ravel() for k in range(3)]
        derivatives["shape"] = np.column_stack(columns) * weight[:, None]
        return (pixels - corners.pixels).ravel() * weight, derivatives

    return term


class CameraPhotos(Departure):
    """What the photos of the board leave open of the camera."""

    stage = Stage.CAMERA
    entries = (
        Entry(
            "few-camera-photos",
            "Few photos tell the camera.",
            "Take eight or more of the board, or give `[camera]`.",
        ),
        Entry(
            "frontal-photos",
            "All photos that tell the camera are frontal: its focal length is as good as unknown.",
            "Tilt the board by 30 to 45 degrees.",
        ),
        Entry(
            "tilted-alike",
            "The board is tilted alike in all photos that tell the camera.",
            "Tilt it in different directions.",
        ),
        Entry(
            "corners-in-middle",
            "No corner of the board lies in the outer third of any picture: the lens's distortion there is a guess.",
            "Let the board reach into the corners of the picture in some photos.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        return [] if state.photoset.camera.matrix is not None else views_told(state.camera.size, posed(state))


class BoardPrint(Departure):
    """A print that is stretched, or not flat."""

    stage = Stage.CAMERA
    entries = (
        Entry(
            "board-stretched",
            "The board is taller or wider than the manifest says.",
            "Print at 100 %, measure both directions, and correct `square_length`.",
            least=0.002,
            sigmas=6.0,
            source="relative; path-traced and drawn sets in order have at most 0.0001",
        ),
        Entry(
            "board-bent",
            "The board is not flat.",
            "Fix it to a plate.",
            least=0.002,
            sigmas=6.0,
            source="of its size; path-traced and drawn sets in order have at most 0.0002",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        given = state.photoset.camera.matrix is not None
        shape = board_shape(state.model, state.camera, posed(state), given)
        if shape is None:
            return []
        state.remarks.residuals["board"] = {
            "stretch": shape.stretch,
            "stretch_error": shape.stretch_error,
            "bend": shape.bend.tolist(),
            "bend_error": shape.bend_error.tolist(),
        }
        return shape.told()


def posed(state: State) -> list[Posed]:
    """Corners and poses of all photos that have a pose of their own."""
    return [*state.boards] + [
        (one.pose_block, one.corners, one.pose)
        for one in state.observations
        if one.corners is not None and one.pose_block != FIXED_POSE
    ]
