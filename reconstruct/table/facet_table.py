"""The facet-pair table: sums over the samples of each (group, incident facet, exit facet) cell.

A group is one view (photo); keeping them apart lets a fit leave a photo out, or find its scale. Tables add.
Every sample k has one weight omega_k, the same for its value, its directions and its place, so that a cell's
means belong to one another: with w = weight, the cell's BRDF is value / w, of variance variance / w^2, at the
mean place place / w and the directions of incident and exit.

The weight of a pixel is its irradiance over the view's typical variance: omega = E / median(E var f), E the
mean over channels of the irradiance. For photon noise, var(f) = g f / E, that is 1 / var(f) of a typical
pixel, the statistical optimum; unlike 1 / var(f) of the pixel itself it is independent of the pixel's own
noise (dark outcomes of one radiance would weigh more, and pull the mean down by one part in the number of
electrons), it is bounded by the largest irradiance, and the cell's mean becomes total radiance over total
irradiance.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from photogonio.reconstruct.table.facets import facet_count

# why a pixel is left out, in the order of the tests; a pixel counts for the first that applies
LEFT_OUT = (
    "outline",  # nearer than the margin to the sample's outline
    "covered",  # by a mirror ball or a white patch
    "unlit",  # the lamp is not wholly above the point's horizon
    "grazing",  # beyond theta_i_max or theta_r_max
    "shadowed",  # by a mirror ball
    "saturated",
    "invalid",  # dust, a hot pixel, a renderer's firefly, beside a saturated one, below black
    "stray",  # light of the surroundings, which nothing tells of, may spoil it (reconstruct.lighting.stray_limits)
)
SUMS = ("count", "weight", "value", "value2", "variance", "incident", "exit", "place")


def _no_pixels() -> np.ndarray:
    return np.zeros((0, len(LEFT_OUT)), np.int64)


@dataclass(frozen=True, slots=True)
class FacetTable:
    """Sums over samples; cells in ascending order of (group, incident facet, exit facet), each once."""

    level: int  # of the icosahedral facets
    channels: tuple[str, ...]
    groups: tuple[str, ...]  # name of each group
    isotropic: bool  # samples were turned about the normal to a canonical incident azimuth first
    group: np.ndarray  # (n,) int32 index in groups
    facet_i: np.ndarray  # (n,) int32
    facet_r: np.ndarray  # (n,) int32
    count: np.ndarray  # (n,) float64 number of samples
    weight: np.ndarray  # (n,) sum of omega
    value: np.ndarray  # (n, c) sum of omega f, 1/sr
    value2: np.ndarray  # (n, c) sum of omega f^2
    variance: np.ndarray  # (n, c) sum of omega^2 var(f)
    incident: np.ndarray  # (n, 3) sum of omega times the unit vector, tangent frame
    exit: np.ndarray  # (n, 3) likewise
    place: np.ndarray  # (n, 3) sum of omega times the world point, length units; zeros where there is none
    left_out: np.ndarray = field(
        default_factory=_no_pixels
    )  # (g, len(LEFT_OUT)) pixels of each group by reason
    # levels by which facets toward the mirror direction are finer; all are numbered at level + finer
    # (photogonio.reconstruct.table.refinement)
    finer: int = 0

    def __len__(self) -> int:
        return len(self.group)

    @property
    def nbytes(self) -> int:
        """Of all arrays."""
        names = ("group", "facet_i", "facet_r", *SUMS, "left_out")
        return sum(getattr(self, name).nbytes for name in names)

    def __add__(self, other: FacetTable) -> FacetTable:
        return add_tables((self, other))

    def take(self, keep: np.ndarray | slice) -> FacetTable:
        """The cells that a mask, or an ascending index array, or a slice, which copies nothing, names."""
        rows: dict[str, Any] = {
            name: getattr(self, name)[keep] for name in ("group", "facet_i", "facet_r", *SUMS)
        }
        return replace(self, **rows)


def accumulate(
    *,
    level: int,
    channels: tuple[str, ...],
    name: str,
    isotropic: bool,
    facet_i: np.ndarray,
    facet_r: np.ndarray,
    incident: np.ndarray,
    exit: np.ndarray,
    place: np.ndarray,
    omega: np.ndarray,
    value: np.ndarray,
    variance: np.ndarray,
    left_out: np.ndarray | None = None,
    finer: int = 0,
) -> FacetTable:
    """One group's table from n samples.

    ``incident`` and ``exit`` are unit vectors (n, 3) in the tangent frame, already turned if ``isotropic``,
    and lie in ``facet_i`` and ``facet_r`` (n,), numbered at ``level + finer``;
    ``place`` (n, 3); ``omega`` (n,); ``value`` and ``variance`` (n, c), 1/sr and its square;
    ``left_out`` counts by reason.
    """
    omega = omega[:, None]
    sums = np.hstack(
        [
            np.ones_like(omega),
            omega,
            omega * value,
            omega * value**2,
            omega**2 * variance,
            omega * incident,
            omega * exit,
            omega * place,
        ]
    )
    counts = np.zeros(len(LEFT_OUT), np.int64) if left_out is None else np.asarray(left_out, np.int64)
    return table_of_sums(
        level=level,
        channels=channels,
        groups=(name,),
        isotropic=isotropic,
        keys=pair_keys(np.zeros(len(omega), np.int64), facet_i, facet_r, level + finer),
        sums=sums,
        left_out=counts[None],
        finer=finer,
    )


def pair_keys(group: np.ndarray, facet_i: np.ndarray, facet_r: np.ndarray, level: int) -> np.ndarray:
    """One int64 a cell that sorts by (group, incident facet, exit facet); inverse: :func:`split_keys`."""
    facets = facet_count(level)
    return (group.astype(np.int64) * facets + facet_i) * facets + facet_r


def split_keys(keys: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Group, incident and exit facet, (n,) int32 each, of keys. Inverse of :func:`pair_keys`."""
    facets = facet_count(level)
    rest, facet_r = np.divmod(keys, facets)
    group, facet_i = np.divmod(rest, facets)
    return group.astype(np.int32), facet_i.astype(np.int32), facet_r.astype(np.int32)


def table_of_sums(
    *,
    level: int,
    channels: tuple[str, ...],
    groups: tuple[str, ...],
    isotropic: bool,
    keys: np.ndarray,
    sums: np.ndarray,
    left_out: np.ndarray,
    finer: int = 0,
) -> FacetTable:
    """The table of rows of sums (n, 11 + 3 c), those of one key added in the order in which they come."""
    order = np.argsort(keys, kind="stable")
    keys, sums = keys[order], sums[order]
    starts = np.flatnonzero(np.diff(keys, prepend=-1))
    if len(starts):
        sums = np.add.reduceat(sums, starts, axis=0)
    group, facet_i, facet_r = split_keys(keys[starts], level + finer)
    c = len(channels)
    parts = np.split(sums, np.cumsum([1, 1, c, c, c, 3, 3]), axis=1)
    columns = {n: np.ascontiguousarray(p) for n, p in zip(SUMS, parts, strict=True)}
    columns["count"], columns["weight"] = columns["count"][:, 0], columns["weight"][:, 0]
    sorted_by = (group, facet_i, facet_r)
    return FacetTable(
        level, channels, groups, isotropic, *sorted_by, **columns, left_out=left_out, finer=finer
    )


def add_tables(tables: Sequence[FacetTable]) -> FacetTable:
    """The sum: groups of one name join, cells of one group and facet pair add, in the order of the tables.

    Raises ``ValueError`` for tables of different level, channels or symmetry, or none at all.
    """
    if not tables:
        raise ValueError("add_tables: no table was given")
    first = tables[0]
    for table in tables[1:]:
        for key in ("level", "finer", "channels", "isotropic"):
            if getattr(table, key) != getattr(first, key):
                raise ValueError(
                    f"add_tables: {key} {getattr(table, key)} differs from {getattr(first, key)}"
                )
    groups = tuple(dict.fromkeys(name for table in tables for name in table.groups))
    number = {name: k for k, name in enumerate(groups)}
    left_out = np.zeros((len(groups), len(LEFT_OUT)), np.int64)
    places = [np.array([number[name] for name in table.groups], np.int32) for table in tables]
    for table, place in zip(tables, places, strict=True):
        np.add.at(left_out, place[: len(table.left_out)], table.left_out)
    if len(groups) == sum(len(table.groups) for table in tables):
        return _one_after_another(tables, places, groups, left_out)
    numbered = first.level + first.finer
    keys = [
        pair_keys(p[t.group], t.facet_i, t.facet_r, numbered) for t, p in zip(tables, places, strict=True)
    ]
    return table_of_sums(
        level=first.level,
        channels=first.channels,
        groups=groups,
        isotropic=first.isotropic,
        keys=np.concatenate(keys),
        sums=np.concatenate([stacked(table) for table in tables]),
        left_out=left_out,
        finer=first.finer,
    )


def _one_after_another(
    tables: Sequence[FacetTable], places: Sequence[np.ndarray], groups: tuple[str, ...], left_out: np.ndarray
) -> FacetTable:
    """The sum of tables that share no group: nothing is added, and memory holds everything but twice."""
    group = np.concatenate([place[table.group] for table, place in zip(tables, places, strict=True)])
    return replace(tables[0], groups=groups, group=group, left_out=left_out, **_columns(tables))


def _columns(tables: Sequence[FacetTable]) -> dict[str, Any]:
    """Facets and sums of tables one after another."""
    return {
        name: np.concatenate([getattr(table, name) for table in tables])
        for name in ("facet_i", "facet_r", *SUMS)
    }


def in_parts(table: FacetTable, rows: int) -> list[FacetTable]:
    """A table as tables of whole groups, whose arrays are parts of its own, with about ``rows`` cells or one group
    each; at least one. Inverse: :func:`of_parts`."""
    ends = np.searchsorted(table.group, np.arange(len(table.groups)), side="right")
    cuts = [0]
    for end in ends.tolist():
        if end - cuts[-1] >= rows:
            cuts.append(end)
    return [table.take(slice(*ends)) for ends in itertools.pairwise([*cuts, len(table)])]


def of_parts(parts: Sequence[FacetTable]) -> FacetTable:
    """The table of which these are parts, in their order."""
    return replace(parts[0], group=np.concatenate([part.group for part in parts]), **_columns(parts))


def of_groups(table: FacetTable, names: Collection[str]) -> FacetTable:
    """The part of a table that belongs to the groups ``names``; inverse of :func:`add_tables` on such parts."""
    kept = [k for k, name in enumerate(table.groups) if name in names]
    place = np.full(len(table.groups), -1, np.int32)
    place[kept] = np.arange(len(kept), dtype=np.int32)
    part = table.take(place[table.group] >= 0)
    left_out = table.left_out[kept] if len(table.left_out) == len(table.groups) else table.left_out
    groups = tuple(table.groups[k] for k in kept)
    return replace(part, groups=groups, group=place[part.group], left_out=left_out)


def stacked(table: FacetTable) -> np.ndarray:
    """The table's sums as rows (n, 11 + 3 c). Inverse of the split in :func:`table_of_sums`."""
    columns = [getattr(table, name) for name in SUMS]
    return np.hstack([c[:, None] if c.ndim == 1 else c for c in columns])
