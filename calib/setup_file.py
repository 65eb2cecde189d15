"""The file of a calibration, ``setup.json``: plain values out and, each checked, in again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.remarks import LeftOut
from photogonio.calib.rig.gaussian import RigTold
from photogonio.calib.setup import BoardSetup, Falloff, Light, Marks, PrintTone, Setup, ViewSetup
from photogonio.capture.diagnosis import by_code, from_codes
from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_json
from photogonio.capture.photoset import MirrorBall, Plane, Sphere

_FORMAT = "photogonio-setup"
_LENSES = (0, 4, 5, 8, 12, 14)  # coefficients that OpenCV's lens models have
LARGEST = 1e15  # of any number that a setup may hold: squares and sums of them stay numbers


def save_setup(setup: Setup, path: str | Path) -> None:
    """Write ``setup`` as JSON, whole or not at all; inverse of :func:`load_setup`."""
    path = Path(path)
    text = json.dumps(setup_document(setup), indent=1, allow_nan=False) + "\n"
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)


def load_setup(path: str | Path) -> Setup:
    """Read what :func:`save_setup` wrote; InputError if it is not such a file."""
    return setup_of(read_json(Path(path)), path)


def setup_document(setup: Setup) -> dict[str, object]:
    """What the file says, in JSON's types; NaN is null. Inverse of :func:`setup_of`."""
    plain = _plain(setup)
    assert isinstance(plain, dict)
    if not setup.rig:
        del plain["rig"]
    found = _plain(by_code(setup.diagnoses))
    return {"format": _FORMAT, "version": 1} | plain | {"diagnoses": found}


def setup_of(data: object, where: object) -> Setup:
    """The setup that a file ``where`` says. Raises InputError naming it and the key that cannot be used."""
    if not isinstance(data, dict) or data.get("format") != _FORMAT:
        raise InputError(where, f'expected "format": "{_FORMAT}"')
    if data.get("version") != 1:
        raise InputError(where, f"version 1 is understood, not {data.get('version')!r:.40}")
    asked: list[str] = []
    try:
        return _setup(_Part(data, "", asked))
    except KeyError as error:
        raise InputError(f"{where}: {asked[-1]}", "is missing") from error
    except (TypeError, ValueError, IndexError, AttributeError, OverflowError) as error:
        what = str(error) if isinstance(error, ValueError) else "is not what a setup has there"
        raise InputError(f"{where}: {asked[-1]}", f"{what:.200}") from error


class _Part(dict[str, Any]):
    """Part of a file's document; which of its keys was asked for last is in ``asked``, by its path."""

    def __init__(self, data: Mapping[str, Any], path: str, asked: list[str]):
        self._path, self._asked = path, asked
        super().__init__({key: self._within(key, value) for key, value in data.items()})

    def _within(self, key: str, value: object) -> object:
        if isinstance(value, dict):
            return _Part(value, f"{self._path}{key}.", self._asked)
        if isinstance(value, list) and any(isinstance(one, dict) for one in value):
            return [self._within(f"{key}[{k}]", one) for k, one in enumerate(value)]
        return value

    def __getitem__(self, key: str) -> Any:
        self._asked[:] = [self._path + key]
        return super().__getitem__(key)

    def get(self, key: str, default: Any = None) -> Any:
        self._asked[:] = [self._path + key]
        return super().get(key, default)


def _plain(value: object) -> object:
    """Dataclasses, arrays and tuples as plain JSON values; NaN as null."""
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value


def _number(value: float | None) -> float:
    """A number, or NaN of null."""
    return float("nan") if value is None else _given(value)


def _given(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise ValueError(f"expected a number, found {value!r:.40}")
    return float(value)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise ValueError(f"expected text, found {value!r:.40}")
    return value


def _one_of(value: object, *known: str) -> str:
    if value not in known:
        raise ValueError(f"expected one of {', '.join(known)}, found {value!r:.40}")
    return _text(value)


def _array(value: object, *shape: int | None, unknown: bool = False) -> np.ndarray:
    """Numbers of a shape, None any length; with ``unknown`` also null, which is NaN."""
    array = np.array(value, dtype=float)
    if array.size == 0 and 0 not in shape and None in shape:
        array = array.reshape([0 if n is None else n for n in shape])
    if array.ndim != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        raise ValueError(f"expected numbers of shape {shape}, found {array.shape}")
    if not (np.abs(array) <= LARGEST).all() and not (unknown and not (np.abs(array) > LARGEST).any()):
        raise ValueError("expected finite numbers")
    return array


def _rows(value: object) -> list[Any]:
    if not isinstance(value, list):
        raise ValueError(f"expected a list, found {value!r:.40}")
    return value


def _object(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"expected an object, found {value!r:.40}")
    return {key: _plain(one) for key, one in value.items()}


def _residuals(data: object) -> dict[str, Any]:
    """What is said of how close all came; only the ball's covariance is reckoned with."""
    result = _object(data)
    sample = data.get("sample") if isinstance(data, dict) else None
    if isinstance(sample, dict) and "covariance" in sample:
        _array(sample["covariance"], 4, 4)
    return result


def _setup(data: Mapping[str, Any]) -> Setup:
    camera, channels = data["camera"], tuple(_text(name) for name in _rows(data["channels"]))
    c = len(channels)
    if c < 1:
        raise ValueError("expected at least one channel")
    width, height = (int(size) for size in _array(camera["size"], 2))
    if min(width, height) < 1:
        raise ValueError("expected a picture's width and height")
    lens = _array(camera["distortion"], None)
    if len(lens) not in _LENSES:
        raise ValueError("expected a lens of OpenCV's models")
    return Setup(
        camera=Camera(_array(camera["matrix"], 3, 3), lens, (width, height)),
        sample=_sample(data["sample"]),
        views=tuple(_view(v, c) for v in _rows(data["views"])),
        scale=_one_of(data["scale"], "absolute", "relative"),
        channels=channels,
        left_out=tuple(LeftOut(_text(o["name"]), _text(o["reason"])) for o in _rows(data["left_out"])),
        warnings=tuple(_text(one) for one in _rows(data["warnings"])),
        residuals=_residuals(data["residuals"]),
        source=_object(data.get("source", {})),
        mirror_balls=tuple(
            MirrorBall(_array(b["center"], 3), _given(b["radius"]))
            for b in _rows(data.get("mirror_balls", []))
        ),
        boards=tuple(_board(b) for b in _rows(data.get("boards", []))),
        ambient=_optional(data.get("ambient"), c),
        falloff=None if data.get("falloff") is None else _falloff(data["falloff"]),
        scale_error=_given(data.get("scale_error", 0.0)),
        diagnoses=from_codes(data.get("diagnoses", {})),
        tone=None if data.get("tone") is None else _tone(data["tone"], c),
        turned=tuple(_text(name) for name in _rows(data.get("turned", []))),
        rig=tuple(told_of(one) for one in _rows(data.get("rig", []))),
    )


def told_of(data: Mapping[str, Any]) -> RigTold:
    """What a set says of a rig, in JSON's types.

    Raises:
        ValueError, KeyError, TypeError: it is not so.
    """
    value = _array(data["value"], None)
    d = len(value)
    information, usual = (_numbers(data[name], d, d) for name in ("information", "usual"))
    return RigTold(_text(data["name"]), value, information, _array(data["before"], d), usual)


def _numbers(value: object, *shape: int) -> np.ndarray:
    """Of any size: the information of what is known very well is large."""
    array = np.array(value, dtype=float)
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"expected finite numbers of shape {shape}")
    return array


def _optional(value: object, *shape: int) -> np.ndarray | None:
    return None if value is None else _array(value, *shape, unknown=True)


def _sample(data: Mapping[str, Any]) -> Sphere | Plane:
    if "center" in data:
        return Sphere(_array(data["center"], 3), _given(data["radius"]))
    return Plane(_array(data["outline"], None, 2), _given(data["height"]))


def _falloff(data: Mapping[str, Any]) -> Falloff:
    return Falloff(_array(data["terms"], 2), _array(data["covariance"], 2, 2), bool(data["allowed"]))


def _tone(data: Mapping[str, Any], c: int) -> PrintTone:
    table = _array(data["table"], None, c)
    if len(table) < 2 or not (np.diff(table, axis=0) >= 0).all() or not (table[-1] > table[0]).all():
        raise ValueError("a tone curve that does not rise")
    return PrintTone(
        table=table,
        error=_array(data["error"], len(table), c),
        seen=_array(data["seen"], 2),
        ink=_array(data["ink"], c),
        misfit=_given(data["misfit"]),
        photos=int(_given(data["photos"])),
        scale_error=_given(data["scale_error"]),
        surround=_given(data.get("surround", 0.0)),
        **_lamps_of_tone(data),
        **_doubts_of_tone(data, c),
    )


def _lamps_of_tone(data: Mapping[str, Any]) -> dict[str, Any]:
    """What files of earlier versions have not."""
    if "lamps" not in data:
        return {}
    lamps = tuple(_text(one) for one in _rows(data["lamps"]))
    places, covariance = (
        _array(data[name], *shape)
        for name, shape in (("places", (len(lamps), 3)), ("covariance", (3 * len(lamps),) * 2))
    )
    return {"lamps": lamps, "places": places, "covariance": covariance}


def _doubts_of_tone(data: Mapping[str, Any], c: int) -> dict[str, Any]:
    """What files of earlier versions have not."""
    if not data.get("doubts"):
        return {}
    doubts = _array(data["doubts"], None, None, c)
    if doubts.shape[1] < 2:
        raise ValueError("expected changes at two codes or more")
    exposures = {_text(name): _given(one) for name, one in data["exposures"].items()}
    if not all(one > 0.0 for one in exposures.values()):
        raise ValueError("expected exposures above 0")
    return {"doubts": doubts, "exposures": exposures}


def _pose(data: Mapping[str, Any]) -> Pose:
    return Pose(_array(data["rotation"], 3, 3), _array(data["translation"], 3))


def _board(data: Mapping[str, Any]) -> BoardSetup:
    covariance, rms = _optional(data["pose_covariance"], 6, 6), _number(data["pose_rms"])
    return BoardSetup(_text(data["name"]), _pose(data["pose"]), rms, covariance, _marks(data["marks"]))


def _marks(data: Mapping[str, Any]) -> Marks:
    return Marks(**{f.name: _array(data[f.name], None, 2, unknown=True) for f in fields(Marks)})


def _light(data: Mapping[str, Any]) -> Light:
    return Light(
        id=_text(data["id"]),
        kind=_one_of(data["kind"], "point", "directional"),
        place=_array(data["place"], 3),
        covariance=_array(data["covariance"], 3, 3, unknown=True),
        source=_text(data["source"]),
        radius=_given(data["radius"]),
        residual=_number(data["residual"]),
    )


def _view(data: Mapping[str, Any], c: int) -> ViewSetup:
    return ViewSetup(
        name=_text(data["name"]),
        light=_light(data["light"]),
        pose=_pose(data["pose"]),
        strength=_array(data["strength"], c),
        strength_error=_array(data["strength_error"], c, unknown=True),
        strength_source=_text(data["strength_source"]),
        pose_rms=_number(data["pose_rms"]),
        pose_covariance=_optional(data.get("pose_covariance"), 6, 6),
        marks=None if data.get("marks") is None else _marks(data["marks"]),
        veil=_optional(data.get("veil"), c),
        veil_error=_optional(data.get("veil_error"), c),
    )
