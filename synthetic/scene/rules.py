"""What the values of a scene may be: one rule a key, told in words when it is broken."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import reduce
from typing import TYPE_CHECKING, Any

from photogonio.capture.errors import InputError
from photogonio.synthetic.scene.phone import SHAPES

if TYPE_CHECKING:
    from photogonio.synthetic.scene.model import Scene

Rule = tuple[str, Callable[[Any], bool]]  # what is expected, whether a value is so
NEEDED = {  # by a board of each kind
    "charuco": ("squares", "square_length", "marker_length"),
    "aruco-grid": ("markers", "marker_length", "marker_separation"),
    "markers": ("marker",),
}
LENS = (0, 4, 5, 8, 12, 14)  # coefficients that OpenCV's lens model may have


def one_of(*allowed: object) -> Rule:
    return f"one of {', '.join(map(str, allowed))}", lambda value: value in allowed


def numbers(*counts: int) -> Rule:
    return f"{' or '.join(map(str, counts))} numbers", lambda value: len(value) in counts


def above(least: float) -> Rule:
    return f"more than {least:g}", lambda value: value > least


def at_least(least: float) -> Rule:
    return f"{least:g} or more", lambda value: value >= least


def between(least: float, most: float) -> Rule:
    return f"a number from {least:g} to {most:g}", lambda value: least <= value <= most


def all_above(count: int, least: float) -> Rule:
    what = f"{count} numbers above {least:g}"
    return what, lambda value: len(value) == count and min(value) > least


COLOR: Rule = ("one number or three, none negative", lambda v: len(v) in (1, 3) and min(v) >= 0)
OUTLINE: Rule = ("three or more corners [x, y]", lambda v: len(v) >= 3 and all(len(p) == 2 for p in v))
ZONE: Rule = (
    "two angles above 0, at most 90",
    lambda v: len(v) == 2 and 0 < min(v) and max(v) <= 90,
)
OPTIONAL_POINT: Rule = ("three numbers", lambda v: v is None or len(v) == 3)
PATCH: dict[str, Rule] = {
    "outline": OUTLINE,
    "reflectance": COLOR,
    "true_reflectance": (COLOR[0], lambda v: v is None or COLOR[1](v)),
}
RULES: dict[str, dict[str, Rule]] = {
    "sample": {
        "shape": one_of("sphere", "plane"),
        "center": numbers(3),
        "radius": above(0),
        "outline": OUTLINE,
        "offset": numbers(3),
    },
    "board": {
        "kind": one_of("charuco", "aruco-grid", "markers"),
        "print_scale": above(0),
        "curl": between(0, 20),
        "paper": between(0, 1),
        "ink": between(0, 1),
        "table": between(0, 1),
        "table_radius": at_least(0),
        "squares": ("two whole numbers above 1", lambda v: v is None or (len(v) == 2 and min(v) > 1)),
        "markers": ("two whole numbers above 0", lambda v: v is None or (len(v) == 2 and min(v) > 0)),
    },
    "mirror_ball": {"center": numbers(3), "radius": above(0), "reflectance": between(0, 1)},
    "white_patch": PATCH,
    "grey_patch": PATCH,
    "camera": {
        "size": all_above(2, 15),
        "focal": above(0),
        "aspect": above(0),
        "center": numbers(2),
        "distortion": numbers(*LENS),
        "distance": all_above(2, 0),
        "elevation": ZONE,
        "motion": one_of("fixed", "moving", "turntable"),
        "calibration": at_least(0),
        "vignetting": one_of("none", "cos4"),
        "defocus": at_least(0),
    },
    "lamp": {
        "count": at_least(1),
        "kind": one_of("point", "directional"),
        "radius": at_least(0),
        "distance": all_above(2, 0),
        "elevation": ZONE,
        "spread": one_of("around", "plane"),
        "places": ("places [x, y, z]", lambda v: all(len(p) == 3 for p in v)),
        "color": COLOR,
        "attached_at": OPTIONAL_POINT,
        "attached_every": at_least(1),
    },
    "sensor": {
        "bits": one_of(8, 16),
        "encoding": one_of("linear", "srgb", "gamma", "tone"),
        "gamma": above(0),
        "format": one_of("png", "tiff", "jpeg", "heic", "dng"),
        "quality": between(1, 100),
        "chroma": one_of("4:2:0", "4:4:4"),
        "primaries": one_of("srgb", "p3"),
        "level": above(0),
        "exposure_time": above(0),
        "f_number": ("more than 0", lambda v: v is None or v > 0),
        "iso": ("more than 0", lambda v: v is None or v > 0),
        "brackets": ("factors above 0", lambda v: all(factor > 0 for factor in v)),
        "gain_electrons": ("0 or more", lambda v: v is None or v >= 0),
        "read_noise_electrons": at_least(0),
        "dark_current": at_least(0),
        "hot_pixels": between(0, 1),
        "fireflies": between(0, 1),
        "black_level": between(0, 0.9),
        "ambient": at_least(0),
        "dark_photos": at_least(0),
    },
    "sensor.floor": {
        "row_electrons": at_least(0),
        "exponent": between(0, 2),
        "column_electrons": at_least(0),
        "pixel_gain": between(0, 0.2),
    },
    "sensor.tone": {"shape": one_of(*SHAPES), "strength": between(0, 1)},
    "sensor.local_tone": {"strength": between(0, 0.9), "reach": above(0)},
    "sensor.denoise": {"code": above(0), "radius": above(0)},
    "sensor.sharpen": {"amount": at_least(0), "radius": above(0)},
    "sensor.exposure": {
        "low": between(0.01, 2),
        "high": between(0.01, 2),
        "bright": between(0.5, 1),
        "steps": one_of(0, 1, 2, 3),
    },
    "camera.shading": {"corner": ("more than 0, at most 1", lambda value: 0 < value <= 1)},
    "lamp.shade": {
        "half_angle": between(1, 90),
        "rim": ("more than 0, at most 90", lambda value: 0 < value <= 90),
        "aim": numbers(3),
    },
    "camera.hand": {"shift": at_least(0), "aim": at_least(0), "roll": at_least(0)},
    "render": {"sample": at_least(1), "near": at_least(1), "edge": at_least(1)},
    "fault": {"moved_by": numbers(3)},
}


def check(scene: Scene, where: object) -> None:
    """Raises InputError for the first value that breaks its rule."""
    for key, value, (expected, holds) in _values(scene):
        if not holds(value):
            raise InputError(f"{where}: {key}", f"expected {expected}, got {_shown(value)}")
    _check_board(scene, where)
    _check_files(scene, where)
    _check_shade(scene, where)
    _check_fault(scene, where)


def _values(scene: Scene) -> Iterator[tuple[str, object, Rule]]:
    for name, rules in RULES.items():
        part = reduce(getattr, name.split("."), scene)
        parts = part if isinstance(part, tuple) else (part,)
        for one in parts:
            if one is not None:  # no board, no such effect
                yield from ((f"{name}.{key}", getattr(one, key), rule) for key, rule in rules.items())


def _check_board(scene: Scene, where: object) -> None:
    board = scene.board
    if board is None:
        return
    for key in NEEDED[board.kind]:
        if not getattr(board, key):
            raise InputError(f"{where}: board.{key}", f"a board of kind {board.kind} needs it")


def _check_files(scene: Scene, where: object) -> None:
    """What a kind of file, of lamp or of motion cannot have."""
    sensor = scene.sensor
    small = sensor.format in ("jpeg", "heic")
    if small and sensor.bits != 8:
        raise InputError(f"{where}: sensor.bits", f"a {sensor.format} has 8")
    if sensor.format == "dng" and (sensor.bits != 16 or sensor.encoding != "linear"):
        raise InputError(f"{where}: sensor.format", 'a dng has bits = 16 and encoding = "linear"')
    if sensor.primaries != "srgb" and not small:
        raise InputError(f"{where}: sensor.primaries", "only a jpeg or heic names them")
    if scene.camera.hand is not None and scene.camera.motion != "moving":
        raise InputError(f"{where}: camera.hand", 'a hand-held camera has motion = "moving"')


def _check_shade(scene: Scene, where: object) -> None:
    lamp, still = scene.lamp, scene.camera.motion != "turntable"
    if lamp.shade is not None and not (lamp.kind == "point" and still):
        raise InputError(
            f"{where}: lamp.shade", 'only a lamp of kind "point" has one, and not over a turntable'
        )


def _check_fault(scene: Scene, where: object) -> None:
    """Faults name views that there are, and leave some."""
    fault = scene.fault
    count = len(scene.lamp.places) or scene.lamp.count
    pairs = [pair for pair in fault.mislabelled if len(pair) != 2]
    if pairs:
        raise InputError(f"{where}: fault.mislabelled", f"expected pairs of views, got {_shown(pairs[0])}")
    named = [*fault.two_lamps, *fault.missing, *(view for pair in fault.mislabelled for view in pair)]
    for view in named:
        if not 0 <= view < count:
            raise InputError(f"{where}: fault", f"expected views from 0 to {count - 1}, got {view}")
    if len(set(fault.missing)) == count:
        raise InputError(f"{where}: fault.missing", "leaves no view")


def _shown(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value
