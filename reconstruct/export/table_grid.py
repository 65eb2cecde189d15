"""The angles at which tables of values are written, and what is said of a BRDF in remarks.

A table is a grid of theta_i, phi_i, theta_r and phi_r - phi_i: a peak stands about one difference of azimuths wherever
light comes from, so that nodes may be dense there. Lines are looked at through the peaks about the mirror's direction
and the light's own, for several incidences: polar nodes are as far apart as keeps an even grid near them in the mean
square, nodes of azimuth as keeps what they add (de Boor, "A practical guide to splines", 1978, on the best knots).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import held
from photogonio.reconstruct.modes.angles import unit_vectors

STEP, TURN, TURNS = 5.0, 15.0, 30.0  # degrees, of polar angles, of azimuths and of the sample's turn, at most
ROWS = {False: 450_000, True: 350_000}  # at most, of a surface that does not turn and of one that does
LAST, LAST_EXIT = 88.0, 89.5  # degrees: at 90 many BRDFs have no finite value
_LOOKS = np.array(
    [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 76.0, 80.0, 83.0, 85.0, 87.0, LAST]
)  # incidences, degrees
_GRAZING, _DENSER = (
    65.0,
    0.65,
)  # degrees: from here on f bends with incidence too, and nodes are so much denser
_POLAR = np.concatenate([np.arange(0.0, 85.0, 0.25), np.arange(85.0, LAST_EXIT + 0.1, 0.125)])
_ASIDE = np.concatenate([[0.0], np.geomspace(0.01, 90.0, 360)])  # azimuths from a peak, degrees
_AROUND = np.arange(0.0, 361.0, 2.0)
_RMS, _SUM = 0.01, 0.01  # of f on a line: what steps of 1 miss of it, and add to it
_FINEST, _FINEST_ASIDE = 0.25, 0.02  # degrees
_TURNS = tuple(
    n for n in range(12, 73) if 720 % n == 0
)  # nodes of phi_i, whose steps are multiples of 0.5 degrees
# how many of those steps it is between polar nodes, exit azimuths and turns, of either kind of surface: four axes are
# dear, and of them the azimuth adds most
_SHARES = {False: (1.0, 0.7, 1.0), True: (1.25, 1.0, 1.4)}
_AT_ONCE = 5000  # lines
_COARSER = 1.04  # steps of the search for a number of rows


@dataclass(frozen=True, slots=True)
class TableNodes:
    """A grid's, degrees."""

    theta_i: np.ndarray
    phi_i: np.ndarray  # one of an isotropic surface
    theta_r: np.ndarray
    dphi: (
        np.ndarray
    )  # phi_r - phi_i: from 0 to 180 if it is isotropic, since the other half is its mirror image

    @classmethod
    def of(cls, brdf: Brdf) -> TableNodes:
        """As coarse as will do, and at most so many as :data:`ROWS` allows."""
        steps, scale = _Steps.of(brdf), 1.0
        found = steps.nodes(scale)
        while found.rows > ROWS[brdf.turning] and scale < 1e3:
            scale *= _COARSER
            found = steps.nodes(scale)
        return found

    @property
    def shape(self) -> tuple[int, int, int, int]:
        return len(self.theta_i), len(self.phi_i), len(self.theta_r), len(self.dphi)

    @property
    def rows(self) -> int:
        return int(np.prod(self.shape))

    def angles(self) -> list[np.ndarray]:
        """theta_i, phi_i, theta_r and phi_r (n,) of the rows, degrees."""
        axes = self.theta_i, self.phi_i, self.theta_r, self.dphi
        theta_i, phi_i, theta_r, dphi = (one.ravel() for one in np.meshgrid(*axes, indexing="ij"))
        turn = phi_i + dphi
        return [theta_i, phi_i, theta_r, np.where(turn < 360.0, turn, turn - 360.0).round(3)]


@dataclass(frozen=True, slots=True)
class TableValues:
    """f at nodes."""

    nodes: TableNodes
    value: np.ndarray  # (theta_i, phi_i, theta_r, dphi, c), 1/sr
    factor: np.ndarray  # (theta_i, phi_i) that is in it, below 1 where lines between rows would add light

    @classmethod
    def of(cls, brdf: Brdf) -> TableValues:
        nodes = TableNodes.of(brdf)
        value = brdf.evaluate(*np.radians(nodes.angles())).reshape(*nodes.shape, -1)
        axes = [np.radians(one) for one in (nodes.theta_i, nodes.phi_i, nodes.theta_r, nodes.dphi)]
        factor = held(brdf, value, axes)
        return cls(nodes, value * factor[:, :, None, None, None], factor)

    def remark(self) -> str:
        """What its values are, as words after "BRDF in 1/sr, "."""
        lowered = 100.0 * (1.0 - float(self.factor.min()))
        if not lowered:
            return "linear between rows"
        return f"linear between rows, and lowered by up to {lowered:.2g} % where such lines would add light"


@dataclass(frozen=True, slots=True)
class _Steps:
    """Degrees between nodes with which lines miss :data:`_RMS` or add :data:`_SUM`."""

    polar: np.ndarray  # at each of _LOOKS
    mirror: np.ndarray  # at _ASIDE from the mirror's azimuth
    retro: np.ndarray  # and from the light's own
    turn: float
    turning: bool

    @classmethod
    def of(cls, brdf: Brdf) -> _Steps:
        turns = np.arange(0.0, 180.0, 22.5) if brdf.turning else np.zeros(1)
        polar = np.array([min(_even_polar(brdf, look, turn) for turn in turns) for look in _LOOKS])
        sides = (1.0, -1.0) if brdf.turning else (1.0,)
        mirror, retro = (
            np.min(
                [_graded(brdf, look, t, middle, s) for look in _LOOKS for t in turns for s in sides], axis=0
            )
            for middle in (180.0, 0.0)
        )
        turn = min(_even_turn(brdf, look) for look in _LOOKS) if brdf.turning else TURNS
        return cls(polar * np.where(_LOOKS > _GRAZING, _DENSER, 1.0), mirror, retro, turn, brdf.turning)

    def nodes(self, scale: float) -> TableNodes:
        """With ``scale`` times those steps."""
        polar, aside, turned = (scale * share for share in _SHARES[self.turning])
        fine = np.linspace(0.0, LAST_EXIT, 2000)
        step = np.clip(polar * np.interp(fine, _LOOKS, self.polar), _FINEST, STEP)
        upright = fine <= LAST
        near, far = (
            _walk(_ASIDE, np.clip(aside * one, _FINEST_ASIDE, TURN)).round(3)
            for one in (self.retro, self.mirror)
        )
        half = np.concatenate([near, 180.0 - far[-2::-1]]).round(3)
        phi_i = np.zeros(1)
        if self.turning:
            count = next((n for n in _TURNS if 360.0 / n <= turned * self.turn), _TURNS[-1])
            phi_i = np.linspace(0.0, 360.0, count, endpoint=False)
            half = np.concatenate([half, 360.0 - half[-2:0:-1]])
        theta_i = _walk(np.append(fine[upright], LAST), np.append(step[upright], step[upright][-1]))
        return TableNodes(theta_i.round(2), phi_i, _walk(fine, step).round(2), half.round(3))


def in_lines(form: str, rows: np.ndarray) -> Iterator[str]:
    """The rows by ``form``, which says a whole line, many at once."""
    for start in range(0, len(rows), _AT_ONCE):
        some = rows[start : start + _AT_ONCE]
        yield form * len(some) % tuple(some.ravel().tolist())


def scale_in_words(brdf: Brdf) -> str:
    """What the values are up to."""
    return "absolute scale" if brdf.scale == "absolute" else "relative scale: up to one factor a channel"


def title(brdf: Brdf) -> str:
    """What the BRDF is called: by the set or table that it came from."""
    return str(brdf.source.get("name") or "photogonio")


def _walk(place: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Nodes from the first place to the last, at most a ``step`` apart."""
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (1 / step[1:] + 1 / step[:-1]) * np.diff(place))])
    count = max(int(np.ceil(passed[-1] - 1e-6)), 1)
    return np.interp(np.linspace(0.0, passed[-1], count + 1), passed, place)


def _on(brdf: Brdf, theta_i: float, phi_i, theta_r, phi_r) -> np.ndarray:
    """f (n, c) at angles in degrees that broadcast together."""
    angles = np.broadcast_arrays(*(np.radians(one) for one in (theta_i, phi_i, theta_r, phi_r)))
    return np.maximum(brdf(unit_vectors(*angles[:2]), unit_vectors(*angles[2:])), 0.0)


def _even_polar(brdf: Brdf, look: float, turn: float) -> float:
    """The step of exit angles in the plane of incidence."""
    cosine = np.cos(np.radians(_POLAR))[:, None]
    return min(_even(_POLAR, cosine * _on(brdf, look, turn, _POLAR, turn + side)) for side in (180.0, 0.0))


def _even_turn(brdf: Brdf, look: float) -> float:
    """The step of the sample's turn, about the mirror's direction and the light's own."""
    cosine = np.cos(np.radians(look))
    return min(
        _even(
            _AROUND, _on(brdf, look, _AROUND, np.clip(look + off, 0.0, LAST), _AROUND + side + aside * cosine)
        )
        for side in (180.0, 0.0)
        for off in (0.0, -8.0, 8.0)
        for aside in (0.0, 6.0, -6.0)
    )


def _graded(brdf: Brdf, look: float, turn: float, middle: float, side: float) -> np.ndarray:
    """(n,) steps of azimuth at _ASIDE from a peak: those that add least to a sum for their number."""
    f = _on(brdf, look, turn, look, turn + middle + side * _ASIDE)
    bend = _bend(_ASIDE, f)
    sums = _integral(_ASIDE, np.cbrt(bend))
    scale = np.sqrt(12.0 * _SUM * _integral(_ASIDE, f) / np.maximum(sums, 1e-300))
    return (scale / np.cbrt(np.maximum(bend, 1e-12 * f.max(axis=0) + 1e-300))).min(axis=1)


def _even(place: np.ndarray, f: np.ndarray) -> float:
    """The step of an even grid, of the worst channel."""
    bend, square = _integral(place, _bend(place, f) ** 2), _integral(place, f**2)
    return float((120.0 * _RMS**2 * square / np.maximum(bend, 1e-12 * square + 1e-300)).min() ** 0.25)


def _bend(place: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Size of the second derivative of f (n, c)."""
    rise = np.diff(f, axis=0) / np.diff(place)[:, None]
    bend = np.abs(np.diff(rise, axis=0)) / (0.5 * (place[2:] - place[:-2]))[:, None]
    return np.concatenate([bend[:1], bend, bend[-1:]])


def _integral(place: np.ndarray, f: np.ndarray) -> np.ndarray:
    """(c,) along a line."""
    return 0.5 * np.diff(place) @ (f[1:] + f[:-1])
