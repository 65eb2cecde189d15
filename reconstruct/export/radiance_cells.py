"""Cells of a tensor tree: means over samples within each, divided where that lowers the error most.

An error counts by projected solid angle, relative to the rms of f for its incident direction, so that dim directions
are as good as bright ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Values = Callable[[np.ndarray], np.ndarray]  # at places (n, axes) of the unit cube, (n,)
_CHUNK = 1 << 17  # cells at once
_ROUNDS, _SLACK = 8, 0.003  # of holding cells to an albedo
_COARSE = 1e-3  # spread at which dividing begins


@dataclass(slots=True)
class Level:
    """Cells of one fineness; the 2^axes parts of a cell stand together, first axis fastest."""

    halvings: int  # of each axis
    place: np.ndarray  # (n, axes) whole numbers, in units of the cell
    mean: np.ndarray  # (n,) of f, 1/sr
    spread: (
        np.ndarray
    )  # (n,) share of the error if it is not divided; never above that of the cell that it is part of
    first: np.ndarray  # (n,) where its parts begin one level down, or -1

    @classmethod
    def of(cls, place: np.ndarray, halvings: int) -> Level:
        count = len(place)
        return cls(halvings, place, np.zeros(count), np.zeros(count), np.full(count, -1))

    def parts(self, chosen: np.ndarray) -> np.ndarray:
        """(m 2^axes, axes) places of the parts of some cells."""
        axes = self.place.shape[1]
        bits = (np.arange(2**axes)[:, None] >> np.arange(axes)) & 1
        return (2 * self.place[chosen, None, :] + bits).reshape(-1, axes)


@dataclass(slots=True)
class CellTree:
    """A tree while it grows."""

    values: Values  # f, gray, 1/sr
    weight: Values  # of a squared error
    incident: int  # how many axes say the incident direction
    levels: list[Level]
    base: int = 0  # the level up to which every cell is divided
    scale: np.ndarray | None = None  # by place of the incident direction at the base: mean of f^2
    total: float = 1.0  # of all weights times f^2

    @classmethod
    def of(cls, values: Values, weight: Values, incident: int, top: Level, halvings: int) -> CellTree:
        """With every cell divided as often, and looked at."""
        found = cls(values, weight, incident, [top])
        while found.levels[-1].halvings < halvings:
            found._divide_all()
        found.base = len(found.levels) - 1
        found._look_everywhere()
        return found

    def grow(self, leaves: int, enough: float, deepest: int) -> float:
        """Divide what is worth it; the spread above which cells are to be divided for at most so many undivided ones,
        or for a relative rms of ``enough`` within them."""
        bound, least = _COARSE, enough**2 / leaves
        while True:
            for depth in range(self.base, deepest - self.levels[0].halvings):
                if depth < len(self.levels):
                    self._divide(depth, bound)
            if bound <= least or self.count(bound) > leaves:
                break
            bound = max(0.5 * bound, least)
        if self.count(bound) <= leaves:
            return bound
        low, high = bound, 1.0
        for _ in range(30):
            middle = np.sqrt(low * high)
            low, high = (low, middle) if self.count(middle) <= leaves else (middle, high)
        return high

    def count(self, bound: float) -> int:
        """Undivided cells, if those with a greater spread that have parts are divided."""
        parts = 2 ** self.levels[0].place.shape[1] - 1
        return len(self.levels[0].place) + parts * sum(
            int(self.divided(one, bound).sum()) for one in self.levels
        )

    @staticmethod
    def divided(level: Level, bound: float) -> np.ndarray:
        """(n,) whether each cell is."""
        return (level.spread > bound) & (level.first >= 0)

    def hold(self, bound: float, albedo: np.ndarray) -> None:
        """Lower means so that the undivided cells send out no more than ``albedo`` and ``_SLACK`` of it, (2^n, ...)
        least values for equal parts of the incident axes, n halvings of each.

        A cell of many parts goes by their mean, since its value alone does not decide what each of them sends out; in
        the last round by the worst.
        """
        fine, whole = len(albedo).bit_length() - 1, self._whole(bound)
        for k in range(_ROUNDS):
            last = k == _ROUNDS - 1
            sent = np.zeros(albedo.shape)
            for level, cells in zip(self.levels, whole, strict=True):
                area = np.pi * 0.5 ** ((level.place.shape[1] - self.incident) * level.halvings)
                part = np.zeros((2**level.halvings,) * self.incident)
                np.add.at(part, tuple(level.place[cells, : self.incident].T), area * level.mean[cells])
                sent += _spread_out(part, fine - level.halvings)
            factor = np.minimum(1.0, (1.0 + last * _SLACK) * albedo / np.maximum(sent, 1e-300))
            for level, cells in zip(self.levels, whole, strict=True):
                of_all = _over(np.min if last else np.mean, factor, fine - level.halvings)
                level.mean[cells] *= of_all[tuple(level.place[cells, : self.incident].T)]

    def _whole(self, bound: float) -> list[np.ndarray]:
        """Places of the undivided cells in each level."""
        alive, found = np.ones(len(self.levels[0].place), bool), []
        for level in self.levels:
            divided = self.divided(level, bound)
            found.append(np.flatnonzero(alive & ~divided))
            parts = np.arange(2 ** level.place.shape[1])
            below = np.zeros(len(parts) * int((level.first >= 0).sum()), bool)
            below[(level.first[alive & divided][:, None] + parts).ravel()] = True
            alive = below
        return found

    def _divide_all(self) -> None:
        last = self.levels[-1]
        last.first = 2 ** last.place.shape[1] * np.arange(len(last.place))
        self.levels.append(Level.of(last.parts(np.arange(len(last.place))), last.halvings + 1))

    def _look_everywhere(self) -> None:
        """Means and spreads from the base up."""
        base = self.levels[self.base]
        base.mean, square = self._sampled(base.place, base.halvings)
        count = 2**base.halvings
        key = self._key(base)
        size = count**self.incident
        held = np.maximum(np.bincount(key, minlength=size), 1)
        mean_square = np.bincount(key, square + base.mean**2, size) / held
        self.scale = np.maximum(mean_square, 1e-12 * max(float(mean_square.max()), 1e-280))
        weight = self._weight(base)
        self.total = max(float((weight * (square + base.mean**2)).sum()), 1e-300)
        base.spread = weight * square / self.total
        for level, below in zip(self.levels[-2::-1], self.levels[:0:-1], strict=True):
            means = below.mean.reshape(len(level.place), -1)
            level.mean = means.mean(axis=1)
            apart = (means - level.mean[:, None]) ** 2 * weight.reshape(means.shape) / self.total
            level.spread = below.spread.reshape(means.shape).sum(axis=1) + apart.sum(axis=1)
            weight = weight.reshape(means.shape).sum(axis=1)

    def _divide(self, depth: int, bound: float) -> None:
        """Cells of a level, from the base down, whose spread is greater and that are whole."""
        level = self.levels[depth]
        chosen = np.flatnonzero((level.spread > bound) & (level.first < 0))
        if not len(chosen):
            return
        new = Level.of(level.parts(chosen), level.halvings + 1)
        new.mean, square = self._sampled(new.place, new.halvings)
        parts = len(new.place) // len(chosen)
        new.spread = np.minimum(
            self._weight(new) * square / self.total, np.repeat(level.spread[chosen], parts)
        )
        level.mean[chosen] = new.mean.reshape(-1, parts).mean(axis=1)
        if depth + 1 == len(self.levels):
            self.levels.append(Level.of(new.place[:0], new.halvings))
        below = self.levels[depth + 1]
        level.first[chosen] = len(below.place) + parts * np.arange(len(chosen))
        for name in ("place", "mean", "spread", "first"):
            setattr(below, name, np.concatenate([getattr(below, name), getattr(new, name)]))

    def _sampled(self, place: np.ndarray, halvings: int) -> tuple[np.ndarray, np.ndarray]:
        """(n,) mean over the centres of a cell's parts, and squared deviation, with that of a slope in the parts."""
        axes = place.shape[1]
        mean, square = np.empty(len(place)), np.empty(len(place))
        for start in range(0, len(place), _CHUNK):
            some = Level.of(place[start : start + _CHUNK], halvings)
            inner = (some.parts(np.arange(len(some.place))) + 0.5) / 2.0 ** (halvings + 1)
            value = self.values(inner).reshape(-1, 2**axes)
            mean[start : start + _CHUNK] = value.mean(axis=1)
            square[start : start + _CHUNK] = value.var(axis=1) * 4.0 / 3.0
        return mean, square

    def _key(self, level: Level) -> np.ndarray:
        """(n,) which of the base's incident directions a cell has."""
        by = level.halvings - self.levels[self.base].halvings
        count = 2 ** self.levels[self.base].halvings
        found = np.zeros(len(level.place), int)
        for axis in range(self.incident):
            found = found * count + (level.place[:, axis] >> by)
        return found

    def _weight(self, level: Level) -> np.ndarray:
        """(n,) of a squared deviation in each cell."""
        assert self.scale is not None
        volume = 2.0 ** (-level.halvings * level.place.shape[1])
        centre = (level.place + 0.5) / 2.0**level.halvings
        return volume * self.weight(centre) / self.scale[self._key(level)]


def _spread_out(value: np.ndarray, halvings: int) -> np.ndarray:
    """Each element once more for each of its parts along every axis."""
    for axis in range(value.ndim):
        value = np.repeat(value, 2**halvings, axis=axis)
    return value


def _over(one: Callable[..., np.ndarray], value: np.ndarray, halvings: int) -> np.ndarray:
    """``one`` of all parts of each element: see :func:`_spread_out`."""
    for axis in range(value.ndim):
        shape = (*value.shape[:axis], value.shape[axis] >> halvings, 2**halvings, *value.shape[axis + 1 :])
        value = one(value.reshape(shape), axis=axis + 1)
    return value
