"""What a fit of photos is told besides their facet table; the table's file carries it, so that to fit again is the
same fit."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from photogonio.calib.remarks import LeftOut
from photogonio.calib.setup import Setup
from photogonio.calib.setup_file import setup_document, setup_of
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Plane, Sphere
from photogonio.options import Choice
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.lighting.lamp_errors import by_lamps
from photogonio.reconstruct.lighting.sample_place import by_place
from photogonio.reconstruct.lighting.stray_limits import Spoilt
from photogonio.reconstruct.lighting.tone_errors import by_tone
from photogonio.reconstruct.lighting.veil_error import veil_error
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.table_file import PHOTOS
from photogonio.run.surroundings import Shown

# relative, of the scale that all photos share: light on the white patch that no model of the set holds. Rendered sets
# of balls and planes come out 0.0 to 0.3 % off, with two of three within this
SCALE_ERROR = 0.002
# standard deviation, in pixels, of what a pixel sees: its own width, and a lens in focus
PIXEL_BLUR = 0.58
LEAST_COSINE = 0.1  # toward the limb, where a pixel sees less and less of the surface alike
VERSION = 1
AROUND, IS_AROUND = "around", "is_around"  # arrays of the table's file
SYMMETRIES = ("auto", "isotropic", "reciprocal", "general")


@dataclass(frozen=True, slots=True)
class Circumstances:
    """Of one photo set, calibrated and reduced."""

    name: str  # of the set
    setup: Setup
    shown: Shown  # around the sample
    symmetry: str  # that the manifest asks for, or the sample's shape
    level: Choice
    left_out: tuple[LeftOut, ...] = ()  # photos that could not be reduced
    diagnoses: tuple[Diagnosis, ...] = ()  # before the fit
    space: str = "camera"  # colours that the manifest asks for
    matrix: np.ndarray | None = None  # (3, 3) from the camera's to XYZ, where it asks for others


def view_errors(setup: Setup, table: FacetTable) -> np.ndarray:
    """Relative standard errors (g,) of the views' scales, as calibration states them."""
    views = {view.name: view for view in setup.views}
    known = [views[name] for name in table.groups]
    return np.array([float(np.max(view.strength_error / view.strength)) for view in known])


def lamp_variances(setup: Setup, table: FacetTable) -> np.ndarray:
    """Variances (g,), radians^2, of the directions of each view's lamp about one axis, as the sample sees a glowing
    ball: a fourth of the square of its angular radius; 0 where its size is not known."""
    sample, views = setup.sample, {view.name: view for view in setup.views}
    middle = np.append(sample.outline.mean(0), sample.height) if isinstance(sample, Plane) else sample.center
    lights = [views[name].light for name in table.groups]
    near = [one.radius**2 * one.toward(middle[None])[1][0] if one.kind == "point" else 0.0 for one in lights]
    return 0.25 * np.array(near)


def phase_of(setup: Setup) -> Callable[[Cells], np.ndarray] | None:
    """Cosines (n,) of the angle between lamp and camera where cells of a ball are; None of a flat sample, on which no
    normal turns."""
    if isinstance(setup.sample, Plane):
        return None
    views = {view.name: view for view in setup.views}

    def cosines(cells: Cells) -> np.ndarray:
        found = np.empty(len(cells))
        for group, name in enumerate(cells.groups):
            rows, view = cells.group == group, views[name]
            back = view.pose.center - cells.place[rows]
            toward = view.light.toward(cells.place[rows])[0]
            found[rows] = np.einsum("ij,ij->i", toward, back) / np.linalg.norm(back, axis=1)
        return found

    return cosines


def shared_by_photos(setup: Setup) -> Callable[[Cells, Model], np.ndarray]:
    """What is not sure of where things stand: changes (n, k, c), 1/sr, of cells' values by one standard deviation of
    each of k unknowns, of the ball's place and of lamps."""
    place, lamps = by_place(setup), by_lamps(setup)

    def changes(cells: Cells, model: Model) -> np.ndarray:
        parts = [lamps(cells, model)] if place is None else [place(cells, model), lamps(cells, model)]
        return np.concatenate(parts, axis=1)

    return changes


def footprints(setup: Setup, table: FacetTable) -> Callable[[Cells], np.ndarray]:
    """Variances (n, 2), radians^2, of the turns by which a pixel of a ball, softened by the lens, sees several normals;
    those of a flat piece are seen alike."""
    views = {view.name: view for view in setup.views}
    eyes = np.array([views[name].pose.center for name in table.groups])
    focal = float(np.sqrt(setup.camera.matrix[0, 0] * setup.camera.matrix[1, 1]))
    radius = setup.sample.radius if isinstance(setup.sample, Sphere) else np.inf

    def turns(cells: Cells) -> np.ndarray:
        distance = np.linalg.norm(cells.place - eyes[cells.group], axis=1)
        across = (PIXEL_BLUR * distance / (focal * radius)) ** 2
        rest = 0.5 * (0.5 * np.pi - cells.theta_r)  # beyond the limb nothing is seen
        along = np.minimum(across / np.maximum(np.cos(cells.theta_r), LEAST_COSINE) ** 2, rest**2)
        turned = np.sin(cells.phi_r - cells.phi_i) ** 2
        x, y = turned * across + (1.0 - turned) * along, turned * along + (1.0 - turned) * across
        return np.column_stack([y, x])

    return turns


def scale_error(setup: Setup, table: FacetTable) -> float:
    """Relative, of the scale that all photos share."""
    veiled = veil_error(table, setup)
    if setup.scale != "absolute":
        return veiled
    shared = setup.scale_error
    if setup.tone is not None and by_tone(setup) is not None:  # which each cell's code tells
        shared = float(np.sqrt(max(shared**2 - setup.tone.scale_error**2, 0.0)))
    return float(np.linalg.norm([SCALE_ERROR, shared, veiled]))


def packed(known: Circumstances) -> dict[str, np.ndarray]:
    """As arrays of a table's file. Inverse of :func:`unpacked`."""
    bare = replace(
        known.setup, views=tuple(replace(view, marks=None) for view in known.setup.views), boards=()
    )
    shown = known.shown
    told = {
        "version": VERSION,
        "name": known.name,
        "setup": setup_document(bare),
        "symmetry": known.symmetry,
        "level": [known.level.what, known.level.value, known.level.reason],
        "left_out": [[one.name, one.reason] for one in known.left_out],
        "diagnoses": [one.to_dict() for one in known.diagnoses],
        "space": known.space,
        "matrix": None if known.matrix is None else known.matrix.tolist(),
        "brightness": None if shown.brightness is None else dict(shown.brightness),
        "grounded": bool(shown.grounded),
        "spoilt": None if shown.spoilt is None else [getattr(shown.spoilt, n) for n in Spoilt.__slots__],
        "why": shown.why,
    }
    arrays = {PHOTOS: np.array(json.dumps(told, allow_nan=False))}
    given = [one for one in shown.around if one is not None]
    if given:
        nothing = np.full_like(given[0], np.nan)
        arrays[AROUND] = np.stack([nothing if one is None else one for one in shown.around])
        arrays[IS_AROUND] = np.array([one is not None for one in shown.around])
    return arrays


def unpacked(arrays: Mapping[str, np.ndarray], table: FacetTable, where: object) -> Circumstances | None:
    """What a table's file carries beside ``table``; None if it is none of photos, or older than this.

    Raises:
        InputError: it is not what :func:`packed` leaves, or does not belong to the table.
    """
    if PHOTOS not in arrays:
        return None
    try:
        told = json.loads(str(arrays[PHOTOS]))
        if told["version"] != VERSION:
            raise ValueError(f"version {VERSION} is understood, not {told['version']!r:.40}")
        known = _circumstances(told, arrays, where)
        _check(known, table)
    except InputError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        raise InputError(where, f"what is told of its photos cannot be used ({error})") from error
    return known


def _circumstances(told: Mapping[str, Any], arrays: Mapping[str, np.ndarray], where: object) -> Circumstances:
    symmetry, matrix, spoilt = told["symmetry"], told["matrix"], told["spoilt"]
    if symmetry not in SYMMETRIES:
        raise ValueError(f"symmetry {symmetry!r:.40}")
    brightness = told["brightness"]
    shown = Shown(
        around=_around(arrays),
        brightness=None if brightness is None else {str(k): float(v) for k, v in brightness.items()},
        grounded=bool(told["grounded"]),
        spoilt=None if spoilt is None else Spoilt(int(spoilt[0]), int(spoilt[1]), *map(float, spoilt[2:])),
        why=str(told["why"]),
    )
    return Circumstances(
        name=str(told["name"]),
        setup=setup_of(told["setup"], where),
        shown=shown,
        symmetry=symmetry,
        level=Choice(*map(str, told["level"])),
        left_out=tuple(LeftOut(str(name), str(reason)) for name, reason in told["left_out"]),
        diagnoses=tuple(map(Diagnosis.from_dict, told["diagnoses"])),
        space=str(told["space"]),
        matrix=None if matrix is None else np.array(matrix, float).reshape(3, 3),
    )


def _around(arrays: Mapping[str, np.ndarray]) -> tuple[np.ndarray | None, ...]:
    if AROUND not in arrays:
        return ()
    whole, given = arrays[AROUND], arrays[IS_AROUND]
    if whole.ndim != 3 or whole.dtype.kind != "f" or given.shape != whole.shape[:1]:
        raise ValueError(f"{AROUND} of shape {whole.shape}")
    return tuple(one if is_given else None for one, is_given in zip(whole, given, strict=True))


def _check(known: Circumstances, table: FacetTable) -> None:
    views = {view.name: view for view in known.setup.views}
    lacking = [name for name in table.groups if name not in views]
    lacking += [name for name in table.channels if name not in known.setup.channels]
    if lacking:
        raise ValueError(f"the table's {lacking[0]!r:.80} is not in its setup")
    if any((views[name].strength <= 0.0).any() for name in table.groups):
        raise ValueError("a lamp's strength is not above 0")
    shown = known.shown
    if shown.brightness is not None:
        if not all(0.0 <= shown.brightness[name] <= 1.0 for name in table.groups):
            raise ValueError("brightness of the surroundings beyond 0 to 1")
    if shown.around:
        shown.check(known.setup, len(table.groups))
