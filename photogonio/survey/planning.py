"""What is to be planned for: a result, photos that are there, or nothing but a kind of material."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogonio.calib.setup import Setup
from photogonio.calib.setup_file import load_setup
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.design.belief import Belief
from photogonio.reconstruct.design.materials import of_material, of_result
from photogonio.reconstruct.design.places import Feasible
from photogonio.reconstruct.design.spots import Piece, Spot, Stance
from photogonio.survey.checker import Checked, Checker
from photogonio.survey.folder import SetFolder
from photogonio.survey.sample_place import middle_of, piece_of

COEFFICIENTS, SETUP = "coefficients.json", "setup.json"
CAMERA_DISTANCE, LAMP_DISTANCE = 600.0, 450.0  # mm, where nothing tells
BALL, FLAT = Piece(True, (25.0, 25.0)), Piece(False, (35.0, 28.0))
FARTHEST = 4.0  # of the camera's distance: a lamp that is farther counts as a distant one


@dataclass(frozen=True, slots=True)
class Aim:
    """What further photos are sought for, and what is there."""

    what: str  # in words
    belief: Belief
    piece: Piece
    middle: np.ndarray  # (3,) of the sample, board frame
    board: tuple[float, float] | None  # its width and height
    taken: tuple[Stance, ...]  # photos that are there
    feasible: Feasible


def aim_of_nothing(kind: str, *, ball: bool) -> Aim:
    """Before any photo, of a kind of material."""
    piece = BALL if ball else FLAT
    middle = np.array([0.0, 0.0, piece.half[0] if ball else 0.0])
    what = f"a {'ball' if ball else 'flat piece'} of {kind} material, before any photo"
    feasible = Feasible(CAMERA_DISTANCE, LAMP_DISTANCE)
    return Aim(what, of_material(kind), piece, middle, None, (), feasible)


def aim_of_result(path: Path) -> Aim:
    """Of a result's folder, or its coefficient file. Raises InputError if it says no errors."""
    file = path / COEFFICIENTS if path.is_dir() else path
    brdf = load_brdf(file)
    beside = file.with_name(SETUP)
    setup = load_setup(beside) if beside.is_file() else None
    try:
        belief = of_result(brdf, turning=brdf.turning)
    except ValueError as error:
        raise InputError(file, str(error)) from error
    piece, middle = _piece_of(setup)
    taken = () if setup is None else tuple(_stance(setup, k, middle) for k in range(len(setup.views)))
    what = (
        f"{path.name}: what its {len(taken)} photos leave open"
        if taken
        else f"{path.name}: what it leaves open"
    )
    return Aim(what, belief, piece, middle, None, taken, _feasible(taken, piece))


def aim_of_set(folder: SetFolder, kind: str, looked: list[Checked], checker: Checker) -> Aim:
    """Of photos that were looked at, for a kind of material. Raises InputError if none tells camera and lamp."""
    taken = tuple(one.shot for one in looked if one.shot is not None)
    scene = checker.scene()
    if scene is None or not taken:
        raise InputError(
            folder.path, "no photo shows both the board and where its lamp stands; `check` tells more"
        )
    piece, belief = piece_of(scene), of_material(kind)
    for one in taken:
        belief = belief.seen(piece.pairs(one))
    what = f"{folder.path.resolve().name}: {len(taken)} photos of a sample that is taken for {kind}"
    size = _board_size(checker)
    return Aim(what, belief, piece, middle_of(scene), size, taken, _feasible(taken, piece))


def held_still(aim: Aim) -> Aim:
    """The same with the camera left where it was in the photos. Raises InputError where there are none."""
    if not aim.taken:
        raise InputError("--still", "there are no photos that tell where the camera stands")
    last = aim.taken[-1].camera
    return replace(aim, feasible=replace(aim.feasible, camera=last))


def with_lamps(aim: Aim, lamps: str) -> Aim:
    """The same with lamps "any", on the camera alone ("flash"), or never there ("lamp")."""
    return replace(aim, feasible=replace(aim.feasible, lamps=lamps))


def _board_size(checker: Checker) -> tuple[float, float] | None:
    from photogonio.calib.geometry.board import board_size

    if checker.board is None:
        return None
    width, height = board_size(checker.board)
    return float(width), float(height)


def _piece_of(setup: Setup | None) -> tuple[Piece, np.ndarray]:
    if setup is None:
        return FLAT, np.zeros(3)
    sample: Sphere | Plane = setup.sample
    if isinstance(sample, Sphere):
        return Piece(True, (sample.radius, sample.radius)), np.asarray(sample.center, float)
    flat = np.asarray(sample.outline, float)
    half = 0.5 * np.ptp(flat, axis=0)
    return Piece(False, (float(half[0]), float(half[1]))), np.append(flat.mean(axis=0), sample.height)


def _stance(setup: Setup, k: int, middle: np.ndarray) -> Stance:
    view = setup.views[k]
    camera = Spot.of(view.pose.center - middle)
    if view.light.kind == "directional":
        return Stance(camera, Spot.of(FARTHEST * camera.distance * view.light.place))
    return Stance(camera, Spot.of(view.light.place - middle))


def _feasible(taken: Sequence[Stance], piece: Piece) -> Feasible:
    if not taken:
        return Feasible(CAMERA_DISTANCE, LAMP_DISTANCE)
    camera = float(np.median([one.camera.distance for one in taken]))
    near = [one.lamp.distance for one in taken if one.lamp.distance < FARTHEST * camera]
    lamp = float(np.median(near)) if near else camera
    return Feasible(camera, lamp)


def is_result(path: Path) -> bool:
    """Whether a path is what `process` leaves, or a coefficient file."""
    return (path / COEFFICIENTS).is_file() or (path.is_file() and path.suffix == ".json")
