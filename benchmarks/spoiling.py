"""Ways in which tables of measurements come out spoilt, or in other terms than they are taken for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

HEADER = "theta_i,phi_i,theta_r,phi_r,value"
SENTINELS = (-999.0, -1.0, -99.0, -9999.0, 9999.0, 1e30, 65535.0, 1e-6, 99.99, -0.1)
GREEN = 0.7  # of a second channel over the first
CHANNELS = {"one-channel": np.array([1.0, GREEN])}  # albedos of a way's channels, over the clean table's
SHARES = (0.01, 0.03, 0.1, 0.2, 0.3)


@dataclass(frozen=True, slots=True)
class Rows:
    """Angles (n,) in radians and readings (n,), 1/sr."""

    theta_i: np.ndarray
    phi_i: np.ndarray
    theta_r: np.ndarray
    phi_r: np.ndarray
    value: np.ndarray

    @property
    def lamp_angle(self) -> np.ndarray:
        """(n,) radians from the lamp's direction."""
        cosine = np.cos(self.theta_i) * np.cos(self.theta_r)
        cosine += np.sin(self.theta_i) * np.sin(self.theta_r) * np.cos(self.phi_r - self.phi_i)
        return np.arccos(np.clip(cosine, -1.0, 1.0))

    def take(self, which: np.ndarray) -> Rows:
        return Rows(
            self.theta_i[which], self.phi_i[which], self.theta_r[which], self.phi_r[which], self.value[which]
        )


def lines_of(rows: Rows, unit: float = 180.0 / np.pi) -> list[str]:
    """Angles in ``unit`` a radian."""
    angles = unit * np.column_stack([rows.theta_i, rows.phi_i, rows.theta_r, rows.phi_r])
    return [
        ",".join(f"{angle:.7g}" for angle in four) + f",{value:.6g}"
        for four, value in zip(angles, rows.value, strict=True)
    ]


def joined(lines: list[str], header: str = HEADER) -> str:
    return "\n".join([header, *lines]) + "\n"


def written(rows: Rows) -> str:
    """The table as a file of this project's has it."""
    return joined(lines_of(rows))


def spoilt(way: str, rows: Rows, rng: np.random.Generator) -> str:
    """The text of the table, spoilt in one of WAYS."""
    found = WAYS[way](rows, rng)
    return found if isinstance(found, str) else written(found)


def _some(rows: Rows, rng: np.random.Generator, shares: tuple[float, ...] = SHARES) -> np.ndarray:
    """(n,) bool, at least one."""
    some = rng.random(len(rows.value)) < rng.choice(shares)
    some[rng.integers(len(some))] = True
    return some


def _with(rows: Rows, where: np.ndarray, value: np.ndarray | float) -> Rows:
    changed = rows.value.copy()
    changed[where] = value
    return replace(rows, value=changed)


def _one_zero(rows, rng):
    return _with(rows, rng.integers(len(rows.value)), 0.0)


def _zeros(rows, rng):
    return _with(rows, _some(rows, rng), 0.0)


def _lamp_hidden(rows, rng):
    return _with(rows, rows.lamp_angle < np.radians(rng.uniform(6, 22)), 0.0)


def _grazing_zero(rows, rng):
    return _with(rows, rows.theta_r >= np.radians(rng.choice([64, 69, 74])), 0.0)


def _block_zero(rows, rng):
    at = rng.integers(len(rows.value))
    apart = np.abs(rows.theta_i - rows.theta_i[at]) + np.abs(rows.theta_r - rows.theta_r[at])
    return _with(rows, apart < np.radians(rng.uniform(10, 30)), 0.0)


def _sentinel(rows, rng):
    return _with(rows, _some(rows, rng), float(rng.choice(SENTINELS)))


def _sentinel_drawn(rows, rng):
    value = float(f"{rng.choice([-1, 1]) * 10 ** rng.uniform(-6, 6):.3g}")
    return _with(rows, _some(rows, rng), value)


def _sentinels(rows, rng):
    for value in rng.choice(SENTINELS, 3, replace=False):
        rows = _with(rows, _some(rows, rng, (0.02, 0.08)), float(value))
    return rows


def _two_channels(rows, rng, spoilt_lines: Callable[[np.ndarray], list[str]]) -> str:
    other = [line.rsplit(",", 1)[1] for line in lines_of(replace(rows, value=GREEN * rows.value))]
    first = spoilt_lines(_some(rows, rng))
    return joined(
        [f"{a},{b}" for a, b in zip(first, other, strict=True)], HEADER.replace("value", "value_R,value_G")
    )


def _sentinel_one_channel(rows, rng):
    mark = float(rng.choice(SENTINELS))
    return _two_channels(rows, rng, lambda some: lines_of(_with(rows, some, mark)))


def _worded(rows, rng):
    word = str(rng.choice(["NaN", "", "inf", "-inf", "n/a", "1.#IND", "-"]))
    pairs = zip(lines_of(rows), _some(rows, rng), strict=True)
    return joined([line.rsplit(",", 1)[0] + "," + word if out else line for line, out in pairs])


def _wavelengths(rows, rng):
    low, high = (lines_of(replace(rows, value=factor * rows.value)) for factor in (0.4, 1.1))
    return joined(
        [f"{line},450" for line in low] + [f"{line},650" for line in high], HEADER + ",wavelength_nm"
    )


def _wavelengths_untold(rows, rng):
    return joined(lines_of(replace(rows, value=0.4 * rows.value)) + lines_of(rows))


def _unmapped(rows, rng):
    name, value = [("wavelength", 550), ("sigma_abs", 1), ("temperature", 23), ("lambda", 0.55)][
        rng.integers(4)
    ]
    return joined([f"{line},{value}" for line in lines_of(rows)], f"{HEADER},{name}")


def _radians(rows, rng):
    return joined(lines_of(rows, 1.0))


def _gradians(rows, rng):
    return joined(lines_of(rows, 200.0 / np.pi))


def _azimuth_radians(rows, rng):
    polar, turned = lines_of(rows), lines_of(rows, 1.0)
    cells = [(one.split(","), two.split(",")) for one, two in zip(polar, turned, strict=True)]
    return joined([",".join([a[0], b[1], a[2], b[3], a[4]]) for a, b in cells])


def _factor(by: float) -> Callable[[Rows, np.random.Generator], Rows]:
    return lambda rows, rng: replace(rows, value=by * rows.value)


def _cosine(name: str) -> Callable[[Rows, np.random.Generator], Rows]:
    return lambda rows, rng: replace(rows, value=rows.value * np.cos(getattr(rows, name)))


def _turned(by: float) -> Callable[[Rows, np.random.Generator], Rows]:
    return lambda rows, rng: replace(rows, phi_r=rows.phi_r + by)


def _azimuth_sign(rows, rng):
    return replace(rows, phi_r=-rows.phi_r)


def _exchanged(rows, rng):
    return Rows(rows.theta_r, rows.phi_r, rows.theta_i, rows.phi_i, rows.value)


def _elevation(rows, rng):
    return replace(rows, theta_i=np.pi / 2 - rows.theta_i, theta_r=np.pi / 2 - rows.theta_r)


def _exit_elevation(rows, rng):
    return replace(rows, theta_r=np.pi / 2 - rows.theta_r)


def _decimal_commas(rows, rng):
    return written(rows).replace(",", ";").replace(".", ",")


def _level(rows, rng) -> float:
    return float(f"{np.quantile(rows.value, rng.uniform(0.1, 0.9)):.4g}")


def _stuck(rows, rng):
    return _with(rows, _some(rows, rng), _level(rows, rng))


def _stuck_run(rows, rng):
    length = int(rng.integers(5, max(len(rows.value) // 6, 6)))
    first = int(rng.integers(len(rows.value) - length))
    return _with(rows, np.s_[first : first + length], float(rows.value[first]))


def _negative(rows, rng):
    some = _some(rows, rng)
    return _with(rows, some, -rows.value[some])


def _all_negative(rows, rng):
    return replace(rows, value=-rows.value)


def _repeated_scaled(rows, rng):
    again = rows.take(rng.integers(len(rows.value), size=len(rows.value) // 4))
    factor = float(rng.choice([0.1, 0.5, 2.0, np.pi, 10.0]))
    return joined(lines_of(rows) + lines_of(replace(again, value=factor * again.value)))


def _shuffled(rows, rng):
    return rows.take(rng.permutation(len(rows.value)))


def _shifted(rows, rng):
    return replace(rows, value=np.roll(rows.value, int(rng.choice([-1, 1]))))


def _scan_scaled(rows, rng):
    scan = np.abs(rows.theta_i - rows.theta_i[rng.integers(len(rows.value))]) < 1e-6
    if scan.sum() < 5:  # scattered: those that were read one after another
        scan = np.roll(np.arange(len(scan)) < 0.1 * len(scan), rng.integers(len(scan)))
    return _with(rows, scan, float(rng.choice([0.1, 0.5, 1.5, 2.0, 10.0])) * rows.value[scan])


def _slipped(rows, rng):
    some = _some(rows, rng, (0.01, 0.03))
    return _with(rows, some, float(rng.choice([0.1, 10.0, 100.0])) * rows.value[some])


def _saturated(rows, rng):
    return replace(rows, value=np.minimum(rows.value, np.quantile(rows.value, rng.uniform(0.6, 0.95))))


def _dark_added(rows, rng):
    return replace(rows, value=rows.value + rng.uniform(0.1, 0.5) * np.median(rows.value))


def _counts(rows, rng):
    """Readings of a detector that no lamp was measured for: their unit is any."""
    return replace(rows, value=np.round(30000.0 * rows.value))


def _every_second(rows, rng):
    """Two detectors that take turns."""
    other = np.arange(len(rows.value)) % 2 == 1
    return _with(rows, other, float(rng.choice([0.75, 1.15, 1.3])) * rows.value[other])


def _drift(rows, rng):
    """A lamp that fades or brightens while lines are written."""
    last = float(rng.choice([0.5, 0.7, 1.5, 2.0]))
    return replace(rows, value=np.linspace(1.0, last, len(rows.value)) * rows.value)


def _beyond_exit(rows, rng):
    far = rows.theta_r > np.radians(rng.uniform(40, 65))
    return _with(rows, far, float(rng.choice([0.7, 0.85, 1.4])) * rows.value[far])


def _one_side(rows, rng):
    side = np.sin(rows.phi_r - rows.phi_i) > 0.01
    return _with(rows, side, float(rng.choice([0.8, 0.9, 1.25])) * rows.value[side])


def _incidence_off(rows, rng):
    """The zero of the lamp's arm."""
    return replace(rows, theta_i=np.maximum(rows.theta_i - np.radians(rng.choice([5.0, 10.0])), 0.0))


WAYS: dict[str, Callable[[Rows, np.random.Generator], Rows | str]] = {
    "one-zero": _one_zero,
    "zeros": _zeros,
    "lamp-hidden": _lamp_hidden,
    "grazing-zero": _grazing_zero,
    "block-zero": _block_zero,
    "sentinel": _sentinel,
    "sentinel-drawn": _sentinel_drawn,
    "sentinels": _sentinels,
    "one-channel": _sentinel_one_channel,
    "worded": _worded,
    "wavelengths": _wavelengths,
    "wavelengths-untold": _wavelengths_untold,
    "unmapped": _unmapped,
    "radians": _radians,
    "gradians": _gradians,
    "azimuth-radians": _azimuth_radians,
    "reflectance-factor": _factor(np.pi),
    "percent": _factor(100.0 * np.pi),
    "cosine-exit": _cosine("theta_r"),
    "cosine-incident": _cosine("theta_i"),
    "azimuth-mirror": _turned(np.pi),
    "azimuth-square": _turned(np.pi / 2),
    "azimuth-sign": _azimuth_sign,
    "exchanged": _exchanged,
    "elevation": _elevation,
    "exit-elevation": _exit_elevation,
    "decimal-commas": _decimal_commas,
    "stuck": _stuck,
    "stuck-run": _stuck_run,
    "negative": _negative,
    "all-negative": _all_negative,
    "repeated-scaled": _repeated_scaled,
    "shuffled": _shuffled,
    "shifted": _shifted,
    "scan-scaled": _scan_scaled,
    "slipped": _slipped,
    "saturated": _saturated,
    "dark-added": _dark_added,
    "counts": _counts,
    "every-second": _every_second,
    "drift": _drift,
    "beyond-exit": _beyond_exit,
    "one-side": _one_side,
    "incidence-off": _incidence_off,
}
