"""Rows of the same pair of directions: further channels below one another, or measurements made again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.robust import deviation
from photogonio.reconstruct.goniometer.columns import WAVELENGTHS, words_of
from photogonio.reconstruct.goniometer.text import TextTable

ALIKE = 1e-6  # radians between directions that are called the same
APART = 1.2  # ratio of values at the same pair, in the middle, that no repeated measurement has
EXPLAINED = 0.3  # of the spread within pairs may be left within the values of a column that explains it
SHARE = 0.1  # of the rows that must share their pair
WANDERS = 1.02  # ratio of wavelengths that are called one
MOST = 40  # values of a column that could be channels
TWICE = 1.15  # ratio in the middle of the last to the first value at a pair, that no repeated measurement has, where
SURE = 2.0  # standard deviations of its logarithm it is from none, by
FEWEST = 8  # pairs; or where, whichever comes first,
LIKE, MANY = 0.6, 30  # a tenth of the pairs at most, of so many, is below that share of the middle one


def pair_numbers(angles: Sequence[np.ndarray]) -> np.ndarray:
    """(n,) which pair of directions each row has, of four angles (n,) in radians; rows of one pair share a number,
    in the order of their first row."""
    theta_i, phi_i, theta_r, phi_r = (
        np.clip(np.where(np.isfinite(angle), angle, -1.0), -1e3, 1e3) for angle in angles
    )
    turn = 2.0 * np.pi
    phi_i, phi_r = np.where(theta_i < ALIKE, 0.0, phi_i % turn), np.where(theta_r < ALIKE, 0.0, phi_r % turn)
    keys = np.rint(np.column_stack([theta_i, phi_i, theta_r, phi_r]) / ALIKE).astype(np.int64)
    keys[:, 1::2] %= round(turn / ALIKE)
    width = round(turn / ALIKE) + 1  # two keys of 64 bits: the four do not fit into one
    both = np.column_stack([keys[:, 0] * width + keys[:, 1], keys[:, 2] * width + keys[:, 3]])
    order = np.lexsort(both.T[::-1])
    new = np.r_[True, np.any(np.diff(both[order], axis=0) != 0, axis=1)]
    number = np.empty(len(keys), np.int64)
    number[order] = np.cumsum(new) - 1
    first = np.full(int(new.sum()), len(keys))
    np.minimum.at(first, number, np.arange(len(keys)))
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[number]


def refuse_mixed(table: TextTable, unused: Sequence[str], pair: np.ndarray, value: np.ndarray) -> None:
    """Raises InputError where rows of the same pair (n,) differ by what a column that is not used says: wavelengths
    below one another, for instance; or where such a column holds several wavelengths, at whatever pairs. ``value``
    (n,)."""
    good = np.isfinite(value)
    count = np.bincount(pair[good], minlength=int(pair.max(initial=-1)) + 1)
    shared = good & (count[pair] > 1)
    if shared.sum() <= SHARE * len(table):
        shared = np.zeros(len(good), bool)
    spread = _spread(pair[shared], value[shared])
    for name in unused:
        words, label = table.labels(name)
        if not 2 <= len(words) <= MOST:
            continue
        colour = bool(words_of(name) & WAVELENGTHS)
        if colour and _several_colours(words, label[good]):
            _refuse_column(table, name, words, "the rows are of several wavelengths")
        if not shared.any() or (label[shared] < 0).any():
            continue
        within = _spread(pair[shared] * len(words) + label[shared], value[shared])
        explains = spread > np.log(APART) and within < EXPLAINED * spread
        if (colour and _several_a_pair(pair[shared], label[shared])) or explains:
            _refuse_column(table, name, words, "the same directions come with several values")


def _refuse_column(table: TextTable, name: str, words: Sequence[str], why: str) -> None:
    listed = ", ".join(words[:6]) + (", ..." if len(words) > 6 else "")
    raise InputError(
        table.path,
        f"{why}, and {name} ({listed}) is not used: choose with "
        f"--where {name}={words[0]}, or take each as a channel with --channel-by {name}",
    )


def _several_colours(words: Sequence[str], label: np.ndarray) -> bool:
    """Whether rows with ``label`` (n,) are of wavelengths further apart than a lamp's line wanders."""
    try:
        found = [float(words[k]) for k in np.unique(label[label >= 0])]
    except ValueError:
        return False
    return bool(found) and min(found) > 0.0 and max(found) > WANDERS * min(found)


def refuse_repeated(path: Path, pair: np.ndarray, value: np.ndarray) -> None:
    """Raises InputError where rows of the same pair (n,) hold values (n,) that are a factor apart, always about the
    same: noise scatters about none."""
    good = np.flatnonzero(value > 0.0)
    order = good[np.argsort(pair[good], kind="stable")]
    if not len(order):
        return
    first = np.flatnonzero(np.diff(pair[order], prepend=-1))
    last = np.r_[first[1:], len(order)] - 1
    several = last > first
    if several.sum() < FEWEST or (last - first)[several].sum() < SHARE * len(order):
        return
    apart = np.log(value[order[last[several]]] / value[order[first[several]]])
    middle, size = float(np.median(apart)), np.abs(apart)
    sure = abs(middle) > max(SURE * float(deviation(apart - middle)), np.log(TWICE))
    typical = float(np.median(size))
    alike = len(size) >= MANY and typical > np.log(TWICE) and np.quantile(size, 0.1) > LIKE * typical
    if sure or alike:
        raise InputError(
            path,
            f"{len(size)} pairs of directions come with several values, the last {np.exp(middle):.3g} times the first "
            "in the middle, and no column tells them apart: wavelengths or scans below one another? Leave one in",
        )


def _several_a_pair(pair: np.ndarray, label: np.ndarray) -> bool:
    """Whether most pairs come with more than one label."""
    pairs, seen = len(np.unique(pair)), len(np.unique(pair * (label.max() + 1) + label))
    return seen > 1.5 * pairs


def _spread(group: np.ndarray, value: np.ndarray) -> float:
    """Natural logarithm of the largest over the least size in a group, of the middle group with several rows; 0 where
    none has."""
    size = np.log(np.maximum(np.abs(value), np.finfo(float).tiny))
    _, place, count = np.unique(group, return_inverse=True, return_counts=True)
    high, low = np.full(len(count), -np.inf), np.full(len(count), np.inf)
    np.maximum.at(high, place, size)
    np.minimum.at(low, place, size)
    several = count > 1
    return float(np.median((high - low)[several])) if several.any() else 0.0


def channels_of(
    table: TextTable, header: str, pair: np.ndarray, value: np.ndarray, names: Sequence[str]
) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """Rows that say the values of one column ``header`` below one another, as channels side by side.

    Gives the row (m,) that each pair with all channels is first seen in; the rows (m, c') of each channel, c' the
    values of the column, to be taken for it; and the names of the c * c' channels. Where a pair was measured again and
    again, the k-th times belong together. ``value`` (n, c) tells which rows say something.

    Raises:
        InputError: no value of the column, more than can be channels, or no pair has all of them.
    """
    words, label = table.labels(header)
    if not 1 <= len(words) <= MOST:
        raise InputError(f"--channel-by {header}", f"has {len(words)} different values; expected 1 to {MOST}")
    good = np.isfinite(value).all(1) & (label >= 0)
    again = _occurrence(pair[good] * len(words) + label[good])
    _, place = np.unique(np.column_stack([pair[good], again]), axis=0, return_inverse=True)
    rows = np.full((int(place.max(initial=-1)) + 1, len(words)), -1)
    rows[place.ravel(), label[good]] = np.flatnonzero(good)
    rows = rows[np.argsort(rows.max(1, initial=-1), kind="stable")]
    full = (rows >= 0).all(1)
    if not full.any():
        raise InputError(
            f"--channel-by {header}",
            f"no pair of directions was measured at all of {', '.join(words[:6])}; choose with --where",
        )
    rows = rows[full]
    named = words if len(names) == 1 else [f"{name} {word}" for word in words for name in names]
    return rows.min(1), rows, tuple(named)


def _occurrence(group: np.ndarray) -> np.ndarray:
    """(n,) how many earlier rows are of the same group."""
    order = np.argsort(group, kind="stable")
    starts = np.flatnonzero(np.diff(group[order], prepend=-1))
    size = np.diff(np.r_[starts, len(group)])
    found = np.empty(len(group), np.int64)
    found[order] = np.arange(len(group)) - np.repeat(starts, size)
    return found
