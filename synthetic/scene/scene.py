"""Scenes from small TOML files or by built-in names (docs/scenes.md)."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_toml
from photogonio.capture.manifest.schema import did_you_mean
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.rules import check

SCENES = Path(__file__).parent / "scenes"


def built_in() -> tuple[str, ...]:
    """Names of the scenes that come with the program."""
    return tuple(sorted(path.stem for path in SCENES.glob("*.toml")))


def load_scene(name_or_path: str | Path) -> Scene:
    """A built-in scene, or one from a TOML file. Raises InputError for an unknown name, key or value."""
    path = scene_path(name_or_path)
    table = without_board(merged(path))
    scene = read(Scene, {"name": path.stem, "folder": str(path.parent), **table}, str(path))
    check(scene, path)
    return scene


def scene_path(name_or_path: str | Path) -> Path:
    path = Path(name_or_path)
    if path.suffix == ".toml":
        return path
    if str(name_or_path) not in built_in():
        hint = did_you_mean(str(name_or_path), built_in())
        raise InputError(name_or_path, f"no such scene: neither built in nor a .toml file{hint}")
    return SCENES / f"{name_or_path}.toml"


def merged(path: Path, depth: int = 0) -> dict[str, object]:
    """The file's tables laid over those of its `base`, a built-in name or a file beside it."""
    table = read_toml(path)
    base = table.pop("base", None)
    if base is None:
        return table
    if depth > 4:
        raise InputError(path, "base: scenes lean on each other without end")
    below = path.parent / base if str(base).endswith(".toml") else scene_path(str(base))
    return overlaid(merged(below, depth + 1), table)


def overlaid(below: dict[str, object], above: dict[str, object]) -> dict[str, object]:
    """Keys of ``above`` replace those of ``below``; tables are laid over each other, but for the BRDF's."""
    out = dict(below)
    for key, value in above.items():
        under = out.get(key)
        if key != "brdf" and isinstance(value, dict) and isinstance(under, dict):
            value = overlaid(under, value)
        out[key] = value
    return out


def without_board(table: dict[str, object]) -> dict[str, object]:
    """TOML has no null: `board = false` says that there is none."""
    return {**table, "board": None} if table.get("board") is False else table


def read(kind: Any, table: object, where: str) -> Any:
    """A dataclass from a table, its unknown keys and wrong types refused."""
    if not isinstance(table, dict):
        raise InputError(where, f"expected a table, got {table!r}")
    hints = get_type_hints(kind)
    for key in table:
        if key not in hints:
            raise InputError(where, f"unknown key {key!r}{did_you_mean(key, list(hints))}")
    values = {key: convert(hints[key], value, f"{where}: {key}") for key, value in table.items()}
    missing = [f.name for f in fields(kind) if f.name not in table and required(f)]
    if missing:
        raise InputError(where, f"the key {missing[0]!r} is required")
    return kind(**values)


def required(item) -> bool:
    return item.default is item.default_factory  # both are dataclasses.MISSING


def convert(hint: Any, value: object, where: str) -> object:
    """A TOML value as the type that a field is declared to have; InputError otherwise."""
    if get_origin(hint) is UnionType:
        return None if value is None else convert(get_args(hint)[0], value, where)
    if is_dataclass(hint):
        return read(hint, value, where)
    if get_origin(hint) is tuple:
        values = value if isinstance(value, list | tuple) else [value]
        return tuple(convert(get_args(hint)[0], v, where) for v in values)
    plain = get_origin(hint) or hint
    if plain is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if not isinstance(value, plain) or (isinstance(value, bool) and plain is not bool):
        raise InputError(where, f"expected {plain.__name__}, got {value!r}")
    return value
