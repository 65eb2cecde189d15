"""The names that cameras give to their shutter times and apertures, and the steps that they mean.

A camera that steps in thirds of a stop calls 1/64 s "1/60" and f/11.3 "f/11", and EXIF has the names; one that steps
in halves calls 1/724 s "1/750". One that does not step, such as a phone, seldom keeps to them. Times of more than half
a minute were counted: the shutter was held open.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

THIRDS, HALVES = 3, 2  # of a stop
HELD = 31.0  # seconds, above which no time is a step's name
SAME = 2e-3  # relative, of a stated value and a name
_SECONDS = ("30", "25", "20", "15", "13", "10", "8", "6", "5", "4", "3.2", "2.5", "2", "1.6", "1.3", "1")
_PARTS = (
    "1 1.3 1.6 2 2.5 3 4 5 6 8 10 13 15 20 25 30 40 50 60 80 100 125 160 200 250 320 400 500 640 800 1000 1250 1600 "
    "2000 2500 3200 4000 5000 6400 8000 10000 12800 16000 20000 25600 32000"
)
_ALIKE = {
    0.3: 5,
    1 / 3: 5,
    0.4: 4,
    0.5: 3,
    0.6: 2,
    0.8: 1,
    0.625: 2,
    0.769231: 1,
}  # seconds, thirds of a stop below 1 s
_NUMBERS = (
    "1 1.1 1.2 1.4 1.6 1.8 2 2.2 2.5 2.8 3.2 3.5 4 4.5 5 5.6 6.3 7.1 8 9 10 11 13 14 16 18 20 22 25 29 32"
)


def _times() -> dict[float, int]:
    """Names in seconds, and thirds of a stop above 1 s."""
    long = {float(name): len(_SECONDS) - 1 - k for k, name in enumerate(_SECONDS)}
    short = {1 / float(name): -k for k, name in enumerate(_PARTS.split())}
    return long | short | {time: -thirds for time, thirds in _ALIKE.items()}


NAMES = {
    "exposure_time": {name: 2.0 ** (thirds / THIRDS) for name, thirds in _times().items()},
    "f_number": {float(name): 2.0 ** (k / THIRDS / 2) for k, name in enumerate(_NUMBERS.split())},
}


_HALF_SECONDS = "30 20 15 10 8 6 4 3 2 1.5 1 0.7 0.5 0.3"
_HALF_PARTS = "4 6 8 10 15 20 30 45 60 90 125 180 250 350 500 750 1000 1500 2000 3000 4000 6000 8000"
_HALF_NUMBERS = "1 1.2 1.4 1.7 2 2.4 2.8 3.3 4 4.8 5.6 6.7 8 9.5 11 13 16 19 22 27 32"
_IN_HALVES = {
    "exposure_time": {
        **{float(name): 2.0 ** ((10 - k) / HALVES) for k, name in enumerate(_HALF_SECONDS.split())},
        **{1 / float(name): 2.0 ** -((k + 4) / HALVES) for k, name in enumerate(_HALF_PARTS.split())},
    },
    "f_number": {float(name): 2.0 ** (k / HALVES / 2) for k, name in enumerate(_HALF_NUMBERS.split())},
}


def step_of(field: str, value: float) -> float | None:
    """What a name stands for; None if ``value`` is none."""
    names = NAMES[field]
    name = min(names, key=lambda known: abs(math.log(known / value)))
    return names[name] if abs(math.log(name / value)) <= SAME else None


def is_name(field: str, value: float) -> bool:
    return step_of(field, value) is not None


def true_steps(field: str, values: Iterable[float]) -> dict[float, float]:
    """The steps that a camera's values mean, if all of them are names or steps; empty if they are not. Names that
    thirds and halves share are thirds', unless another is of halves alone."""
    every = set(values)
    held = {value: value for value in every if field == "exposure_time" and value > HELD}
    steps = _thirds(field, every - held.keys()) or _halves(field, every - held.keys())
    return steps | held if steps else {}


def _halves(field: str, values: Iterable[float]) -> dict[float, float]:
    names, found = _IN_HALVES[field], dict[float, float]()
    for value in sorted(values):
        name = min(names, key=lambda known: abs(math.log(known / value)))
        if abs(math.log(name / value)) > SAME:
            return {}
        found[value] = names[name]
    return found


def _thirds(field: str, values: Iterable[float]) -> dict[float, float]:
    found: dict[float, float] = {}
    steps = set(NAMES[field].values())
    for value in sorted(set(values)):
        step = step_of(field, value)
        if step is None and not any(abs(math.log(known / value)) <= SAME for known in steps):
            return {}
        found[value] = value if step is None else step
    return found
