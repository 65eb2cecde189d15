"""Cells of a tensor tree: f at their centres, divided where that lowers the error most.

Errors are counted by several measures at once, each relative to f's own size by it. What a cell loses if it is not
divided is told by the centres of its parts; before it has parts, by those of itself and its neighbours in the cell that
they are part of: a slope of f there makes a third of their variance within each. So every cell is looked at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

# at places (n, axes) of the unit cube: f, 1/sr, (n,), and the weight of its squared error by each measure, (n, k);
# the first is over f^2's mean for each incident direction, so that dim ones are as good as bright ones
Look = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
Near = Callable[[np.ndarray, int], np.ndarray]  # places and halvings of cells: (n,) bool
_CHUNK = 1 << 17  # cells at once
_ROUNDS, _SLACK, _LEFT = 8, 0.003, 1e-4  # of holding cells to an albedo
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

    def add(self, more: Level) -> None:
        for name in ("place", "mean", "spread", "first"):
            setattr(self, name, np.concatenate([getattr(self, name), getattr(more, name)]))


@dataclass(slots=True)
class CellTree:
    """A tree while it grows."""

    look: Look
    shares: np.ndarray  # (k,) what a squared error by each measure counts
    incident: int  # how many axes say the incident direction
    levels: list[Level]
    base: int = 0  # the level up to which every cell is divided
    scale: np.ndarray = field(default_factory=lambda: np.ones(1))  # of f^2, by incident direction at the base
    # (k,) of all weights times f^2, over the shares
    total: np.ndarray = field(default_factory=lambda: np.ones(1))

    @classmethod
    def of(cls, look: Look, shares: np.ndarray, incident: int, top: Level, halvings: int) -> CellTree:
        """With every cell divided as often, and looked at."""
        found = cls(look, shares, incident, [top])
        while found.levels[-1].halvings < halvings:
            found._divide_all()
        found.base = len(found.levels) - 1
        found._look_everywhere()
        return found

    def look_closely(self, near: Near, halvings: int) -> None:
        """Divide cells below the base that are ``near`` what may be narrower than they are, whatever their centres
        tell."""
        for depth in range(self.base + 1, halvings - self.levels[0].halvings):
            level = self.levels[depth]
            self._divide_some(depth, np.flatnonzero(near(level.place, level.halvings) & (level.first < 0)))
        parts = 2 ** self.levels[0].place.shape[1]
        for level, below in zip(self.levels[-2::-1], self.levels[:0:-1], strict=True):
            inner = level.first >= 0
            together = below.spread.reshape(-1, parts).sum(axis=1)[level.first[inner] // parts]
            level.spread[inner] = np.maximum(level.spread[inner], together)

    def grow(self, few: int, enough: float, most: int, at_most: float, deepest: int) -> float:
        """The spread above which cells are to be divided: for a relative rms error of ``enough`` with ``few`` undivided
        ones or less; where ``few`` leave more than ``at_most``, for that with no more than ``most``."""
        bound, least = _COARSE, enough**2 / most
        while True:
            for depth in range(self.base + 1, deepest - self.levels[0].halvings):
                if depth < len(self.levels):
                    self._divide(depth, bound)
            spread, counts, errors = self._progress()
            done = int((spread > bound).sum())
            count, error = counts[done], errors[done]
            if (
                count > most
                or (error <= at_most**2 and (count > few or error <= enough**2))
                or bound <= least
            ):
                break
            bound = max(0.5 * bound, least)
        allowed = int(np.searchsorted(counts, few, side="right")) - 1
        asked = enough
        if errors[min(allowed, done)] > at_most**2:
            allowed, asked = int(np.searchsorted(counts, most, side="right")) - 1, at_most
        reached = np.flatnonzero(errors[: done + 1] <= asked**2)
        taken = max(min(allowed, int(reached[0]) if len(reached) else done, done), 0)
        return float(spread[taken]) if taken < len(spread) else 0.0

    def _progress(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(m,) spreads of cells that have parts, greatest first; (m + 1,) how many cells are undivided, and what they
        lose together, if so many of those are divided."""
        top = self.levels[0]
        parts = 2 ** top.place.shape[1]
        each, together = [], []
        for level, next_one in zip(self.levels, self.levels[1:], strict=False):
            inner = level.first >= 0
            each.append(level.spread[inner])
            together.append(next_one.spread.reshape(-1, parts).sum(axis=1)[level.first[inner] // parts])
        spread, below = np.concatenate(each), np.concatenate(together)
        order = np.argsort(-spread, kind="stable")
        counts = len(top.place) + (parts - 1) * np.arange(len(order) + 1)
        falls = np.concatenate([[0.0], np.cumsum((below - spread)[order])])
        return spread[order], counts, top.spread.sum() + falls

    def count(self, bound: float) -> int:
        """Undivided cells, if those with a greater spread that have parts are divided."""
        spread, counts, _ = self._progress()
        return int(counts[(spread > bound).sum()])

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
        fine = len(albedo).bit_length() - 1
        whole = []  # of each level that has any: the level, cells, and where they stand among its incident directions
        for level, cells in zip(self.levels, self._whole(bound), strict=True):
            shape = (2**level.halvings,) * self.incident
            if len(cells):
                key = np.ravel_multi_index(tuple(level.place[cells, : self.incident].T), shape)
                whole.append((level, cells, key, shape))
        k = 0
        while k < _ROUNDS:
            sent = np.zeros(albedo.shape)
            for level, cells, key, shape in whole:
                area = np.pi * 0.5 ** ((level.place.shape[1] - self.incident) * level.halvings)
                part = area * np.bincount(key, level.mean[cells], int(np.prod(shape)))
                sent += _spread_out(part.reshape(shape), fine - level.halvings)
            if (sent <= (1.0 + _LEFT) * albedo).all():
                k = max(k, _ROUNDS - 1)
            last = k == _ROUNDS - 1
            factor = np.minimum(1.0, (1.0 + last * _SLACK) * albedo / np.maximum(sent, 1e-300))
            for level, cells, key, _ in whole:
                of_all = _over(np.min if last else np.mean, factor, fine - level.halvings)
                level.mean[cells] *= of_all.ravel()[key]
            k += 1

    def flat(self, bound: float) -> tuple[np.ndarray, np.ndarray]:
        """Of all cells, level by level: where the parts of those divided begin, or -1, and their means."""
        starts = np.cumsum([0, *(len(level.place) for level in self.levels)])
        child = [
            np.where(self.divided(level, bound), level.first + start, -1)
            for level, start in zip(self.levels, starts[1:], strict=True)
        ]
        return np.concatenate(child), np.concatenate([level.mean for level in self.levels])

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
        """Means and spreads from below the base up."""
        self._divide_all()
        base, below = self.levels[self.base], self.levels[self.base + 1]
        below.mean, weight = self._looked(below.place, below.halvings)
        square = below.mean**2
        key = self._key(base.place, base.halvings)
        size = 2 ** (base.halvings * self.incident)
        held = np.maximum(np.bincount(key, minlength=size), 1)
        mean_square = np.bincount(key, square.reshape(len(base.place), -1).mean(axis=1), size) / held
        self.scale = np.maximum(mean_square, 1e-12 * max(float(mean_square.max()), 1e-280))
        weight[:, 0] /= self.scale[self._key(below.place, below.halvings)]
        self.total = np.maximum(weight.T @ square, 1e-300) / self.shares
        weight = (weight / self.total).sum(axis=1)
        for level, parts in zip(self.levels[-2::-1], self.levels[:0:-1], strict=True):
            means, shares = (one.reshape(len(level.place), -1) for one in (parts.mean, weight))
            level.mean, weight = means.mean(axis=1), shares.sum(axis=1)
            if level is base:
                self._tell(level, slice(None), parts, shares)
                continue
            within = parts.spread.reshape(means.shape).sum(axis=1)
            level.spread = within + ((means - level.mean[:, None]) ** 2 * shares).sum(axis=1)

    def _divide(self, depth: int, bound: float) -> None:
        """Cells of a level whose spread is greater and that are whole."""
        level = self.levels[depth]
        chosen = np.flatnonzero((level.spread > bound) & (level.first < 0))
        known = level.spread[chosen]
        self._divide_some(depth, chosen)
        level.spread[chosen] = np.minimum(level.spread[chosen], known)  # never above that of the cell above

    def _divide_some(self, depth: int, chosen: np.ndarray) -> None:
        """Cells of a level, by their places in it."""
        if not len(chosen):
            return
        level = self.levels[depth]
        if depth + 1 == len(self.levels):
            self.levels.append(Level.of(level.place[:0], level.halvings + 1))
        below = self.levels[depth + 1]
        new = Level.of(level.parts(chosen), level.halvings + 1)
        new.mean, weight = self._looked(new.place, new.halvings)
        weight[:, 0] /= self.scale[self._key(new.place, new.halvings)]
        level.mean[chosen] = new.mean.reshape(len(chosen), -1).mean(axis=1)
        self._tell(level, chosen, new, (weight / self.total).sum(axis=1).reshape(len(chosen), -1))
        level.first[chosen] = len(below.place) + len(new.place) // len(chosen) * np.arange(len(chosen))
        below.add(new)

    @staticmethod
    def _tell(level: Level, chosen, parts: Level, shares: np.ndarray) -> None:
        """Spreads of cells and of their parts, by the parts' means and ``shares`` of weight (cells, parts)."""
        means = parts.mean.reshape(shares.shape)
        variance = means.var(axis=1)
        told = shares.sum(axis=1) * variance * 4.0 / 3.0  # of the parts' centres, and of a slope within each
        level.spread[chosen] = told
        parts.spread = np.minimum(shares * (variance / 3.0)[:, None], told[:, None]).ravel()

    def _looked(self, place: np.ndarray, halvings: int) -> tuple[np.ndarray, np.ndarray]:
        """(n,) f at the centres of cells, and (n, k) weights times the cells' volume."""
        value, weight = [], []
        for start in range(0, len(place), _CHUNK):
            f, some = self.look((place[start : start + _CHUNK] + 0.5) / 2.0**halvings)
            value.append(f)
            weight.append(some * 2.0 ** (-halvings * place.shape[1]))
        return np.concatenate(value), np.concatenate(weight)

    def _key(self, place: np.ndarray, halvings: int) -> np.ndarray:
        """(n,) which of the base's incident directions a cell has."""
        by = halvings - self.levels[self.base].halvings
        count = 2 ** self.levels[self.base].halvings
        found = np.zeros(len(place), int)
        for axis in range(self.incident):
            found = found * count + (place[:, axis] >> by)
        return found


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
