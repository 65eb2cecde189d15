"""The tables of ``photoset.toml``: each key's rule, and what the keys of one table ask of one another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.manifest.schema import (
    Key,
    array,
    boolean,
    choice,
    did_you_mean,
    integer,
    listed,
    number,
    per_channel,
    shown,
    table,
    tables,
    text,
)
from photogonio.capture.photoset import (
    PAPERS,
    Board,
    CameraEntry,
    CharucoBoard,
    GreyPatch,
    GridBoard,
    LightEntry,
    LooseMarkers,
    MirrorBall,
    Photo,
    Plane,
    Radiometry,
    Sphere,
    WhitePatch,
)

POSITIVE = number(above=0.0)
FINITE = number()
ROLES = ("calibration", "sample", "probe", "dark", "flat", "ambient", "chart")
DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)  # of OpenCV's models
DEMOSAIC = ("superpixel", "linear", "vng", "ppg", "ahd", "dht")
KINDS = {  # table: the keys that belong to one kind only, and whether they must be there
    "board": {
        "charuco": {"squares": True, "square_length": True, "marker_length": True, "legacy_pattern": False},
        "aruco-grid": {"markers": True, "marker_length": True, "marker_separation": True},
        "markers": {"marker": True},
    },
    "sample": {
        "sphere": {"center": True, "radius": True},
        "plane": {"outline": True, "height": False},
    },
    "light": {"point": {"position": False}, "directional": {"direction": False}},
}


def dictionary(value: object, where: str) -> str:
    """The name of one of OpenCV's predefined dictionaries."""
    known = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
    if value not in known:
        hint = did_you_mean(value, known) if isinstance(value, str) else ""
        hint = hint if "did you mean" in hint else ""
        raise InputError(where, f"expected an OpenCV dictionary's name, found {shown(value)}{hint}")
    return value


def build_board(values: dict[str, Any], where: str) -> Board:
    kind = values["kind"]
    check_kind(values, where, table="board", key="kind")
    given = {name: value for name, value in values.items() if name not in ("kind", "marker")}
    board: Board
    ids: Sequence[int]
    if kind == "charuco":
        board = CharucoBoard(**given)
        if board.marker_length >= board.square_length:
            raise InputError(f"{where} marker_length", "expected less than square_length")
        ids = range(board.first_id, board.first_id + board.squares[0] * board.squares[1] // 2)
    elif kind == "aruco-grid":
        board = GridBoard(**given)
        ids = range(board.first_id, board.first_id + board.markers[0] * board.markers[1])
    else:
        board = LooseMarkers(values["dictionary"], values["marker"])
        ids = [number for number, _ in board.marker_corners]
        for number, corners in board.marker_corners:
            across = np.linalg.svd(np.asarray(corners) - np.mean(corners, axis=0), compute_uv=False)[:2]
            if across[1] < _NARROW * across[0] or across[0] == 0:
                raise InputError(f"{where} marker", f"the corners of marker {number} span no square")
    size = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)).bytesList)
    if max(ids) >= size:
        raise InputError(where, f"needs marker {max(ids)}, but {board.dictionary} ends at {size - 1}")
    if len(set(ids)) < len(ids):
        raise InputError(where, "a marker's id is used twice")
    return board


def check_kind(values: dict[str, Any], where: str, *, table: str, key: str) -> None:
    """The keys that the chosen kind needs are there; those that belong to other kinds are not."""
    kinds, chosen = KINDS[table], values[key]
    for name, required in kinds[chosen].items():
        if required and name not in values:
            raise InputError(where, f'the key {name!r} is required with {key} = "{chosen}"')
    for name in values:
        owners = [kind for kind, keys in kinds.items() if name in keys]
        if owners and chosen not in owners:
            raise InputError(f"{where} {name}", f'does not apply with {key} = "{chosen}"')


def build_sample(values: dict[str, Any], where: str) -> tuple[Sphere | Plane, str]:
    check_kind(values, where, table="sample", key="shape")
    shape, symmetry = values.pop("shape"), values.pop("symmetry", "auto")
    return (Sphere if shape == "sphere" else Plane)(**values), symmetry


def outline(value: object, where: str) -> np.ndarray:
    """Corners (n, 2) of a convex polygon, in either sense; it turns by a whole turn, always to one side."""
    corners = array(None, 2)(value, where)
    edges = np.roll(corners, -1, axis=0) - corners
    following = np.roll(edges, -1, axis=0)
    cross = edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0]
    turns = np.arctan2(cross, (edges * following).sum(axis=1))
    one_sided = (turns >= 0).all() or (turns <= 0).all()
    if len(corners) < 3 or not one_sided or abs(abs(turns.sum()) - 2 * math.pi) > 1e-6:
        raise InputError(where, f"expected the corners of a convex polygon in order, found {shown(value)}")
    return corners


def camera_matrix(value: object, where: str) -> np.ndarray:
    matrix = array(3, 3)(value, where)
    shape = np.array([[1, 0, 1], [0, 1, 1], [0, 0, 1]], bool)
    if (matrix[~shape] != 0).any() or matrix[2, 2] != 1 or matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        raise InputError(where, f"expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], found {shown(value)}")
    return matrix


def distortion(value: object, where: str) -> np.ndarray:
    values = array(None)(value, where)
    if len(values) not in DISTORTION_LENGTHS:
        lengths = ", ".join(map(str, DISTORTION_LENGTHS))
        raise InputError(where, f"expected {lengths} numbers (OpenCV's models), found {len(values)}")
    return values


def rotation(value: object, where: str) -> np.ndarray:
    """A rotation, rounded as files are; made exactly orthonormal."""
    matrix = array(3, 3)(value, where)
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-3 or np.linalg.det(matrix) < 0:
        raise InputError(where, f"expected a right-handed rotation matrix, found {shown(value)}")
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt


def build_camera(values: dict[str, Any], where: str) -> CameraEntry:
    for one, other in (("rotation", "translation"), ("translation", "rotation"), ("distortion", "matrix")):
        if one in values and other not in values:
            raise InputError(where, f"{one} needs {other}")
    return CameraEntry(**values)


def build_radiometry(values: dict[str, Any], where: str) -> Radiometry:
    radiometry = Radiometry(**values)
    if (radiometry.encoding == "gamma") != (radiometry.gamma is not None):
        raise InputError(where, 'encoding = "gamma" and the key gamma go together')
    if radiometry.read_noise_electrons is not None and radiometry.gain_electrons is None:
        raise InputError(where, "read_noise_electrons needs gain_electrons")
    black = radiometry.black_level or 0.0
    if radiometry.white_level is not None and radiometry.white_level <= black:
        raise InputError(where, f"white_level {radiometry.white_level:g} is not above black_level {black:g}")
    return radiometry


def build_light(values: dict[str, Any], where: str) -> LightEntry:
    if "kind" in values:
        check_kind(values, where, table="light", key="kind")
    if "position" in values and "direction" in values:
        raise InputError(where, "give position (a point) or direction (directional), not both")
    if "direction" in values:
        length = np.linalg.norm(values["direction"])
        if length == 0:
            raise InputError(f"{where} direction", "has no length")
        values["direction"] = values["direction"] / length
    return LightEntry(**values)


def lamp_markers(value: object, where: str) -> dict[str, Any]:
    if not isinstance(value, dict) or "ids" not in value:
        raise InputError(where, f"expected a table with ids, found {shown(value)}")
    listed(integer(low=0))(value["ids"], f"{where} ids")
    return value


def light_with_markers(values: dict[str, Any], where: str) -> LightEntry:
    markers = dict(values.pop("markers", {}))
    ids = tuple(markers.pop("ids", ()))
    return build_light({**values, "marker_ids": ids, "markers": markers}, where)


_NARROW = 0.3  # of the longer way across a marker, that its corners lie apart the other way: a square has 1
BOARD_TABLE = {
    "kind": Key(choice(*KINDS["board"]), required=True),
    "dictionary": Key(dictionary, required=True),
    "squares": Key(listed(integer(low=2, high=1000), least=2, most=2)),
    "square_length": Key(POSITIVE),
    "markers": Key(listed(integer(low=1, high=1000), least=2, most=2)),
    "marker_length": Key(POSITIVE),
    "marker_separation": Key(POSITIVE),
    "first_id": Key(integer(low=0)),
    "legacy_pattern": Key(boolean),
    "marker": Key(
        tables(
            {"id": Key(integer(low=0), required=True), "corners": Key(array(4, 3), required=True)},
            lambda values, where: (values["id"], values["corners"]),
        )
    ),
}
SAMPLE_TABLE = {
    "shape": Key(choice(*KINDS["sample"]), required=True),
    "center": Key(array(3)),
    "radius": Key(POSITIVE),
    "outline": Key(outline),
    "height": Key(FINITE),
    "symmetry": Key(choice("auto", "isotropic", "reciprocal", "general")),
}
RADIOMETRY_TABLE = {
    "encoding": Key(choice("auto", "linear", "srgb", "gamma", "unknown")),
    "gamma": Key(number(above=0.0, high=10.0)),
    "black_level": Key(number(low=0.0, below=1.0)),
    "white_level": Key(POSITIVE),
    "gain_electrons": Key(POSITIVE),
    "read_noise_electrons": Key(number(low=0.0)),
    "paper": Key(choice(*PAPERS)),
    "vignetting": Key(choice("auto", "cos4", "none", "flat")),
    "colour": Key(choice("camera", "srgb", "xyz")),
    "demosaic": Key(choice(*DEMOSAIC)),
}
CAMERA_TABLE = {
    "matrix": Key(camera_matrix),
    "distortion": Key(distortion),
    "rotation": Key(rotation),
    "translation": Key(array(3)),
    "fixed": Key(boolean),
}
LIGHT_TABLE = {
    "id": Key(text, required=True),
    "kind": Key(choice(*KINDS["light"])),
    "position": Key(array(3)),
    "direction": Key(array(3)),
    "intensity": Key(per_channel()),
    "radius": Key(POSITIVE),
    "attached_to": Key(choice("camera")),
    "markers": Key(lamp_markers),
}
PHOTO_TABLE = {
    "file": Key(text, required=True),
    "role": Key(choice(*ROLES), required=True),
    "light": Key(text),
    "exposure_time": Key(POSITIVE),
    "f_number": Key(POSITIVE),
    "iso": Key(POSITIVE),
    "bracket": Key(integer()),
    "turned": Key(boolean),
}
BALL_TABLE = {"center": Key(array(3), required=True), "radius": Key(POSITIVE, required=True)}
PATCH_TABLE = {
    "outline": Key(outline, required=True),
    "height": Key(FINITE),
    "reflectance": Key(per_channel(high=1.5), required=True),  # fluorescent paper passes 1
}
GREY_TABLE = {"outline": Key(outline, required=True), "height": Key(FINITE)}
MANIFEST_KEYS = {
    "format": Key(integer(low=1, high=1), required=True),
    "name": Key(text),
    "length_unit": Key(text),
    "board": Key(table(BOARD_TABLE, build_board)),
    "sample": Key(table(SAMPLE_TABLE, build_sample), required=True),
    "mirror_ball": Key(tables(BALL_TABLE, lambda values, where: MirrorBall(**values))),
    "white_patch": Key(tables(PATCH_TABLE, lambda values, where: WhitePatch(**{"height": 0.0, **values}))),
    "grey_patch": Key(tables(GREY_TABLE, lambda values, where: GreyPatch(**values))),
    "radiometry": Key(table(RADIOMETRY_TABLE, build_radiometry)),
    "camera": Key(table(CAMERA_TABLE, build_camera)),
    "light": Key(tables(LIGHT_TABLE, light_with_markers)),
    "photo": Key(tables(PHOTO_TABLE, lambda values, where: Photo(**values))),
}
