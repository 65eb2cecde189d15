"""The facet-pair matrix: a BRDF as a lookup table, and what symmetry leaves free in it.

Source: Koenderink et al. (1996), section 6: "this representation of the BRDF by a 40 x 40 matrix, or larger, is of
interest by itself ... the matrix can be used as a lookup table".
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import coo_array, csr_array

from photogonio.reconstruct.modes.angles import pair_angles
from photogonio.reconstruct.table.facets import barycentres, facet_count, facet_index, solid_angles, vertices


@dataclass(frozen=True, slots=True)
class FacetMatrix:
    """Values of a BRDF on pairs of facets."""

    level: int  # 1 to 7
    values: np.ndarray  # (f, f, c) incident, exit; 1/sr

    def nearest(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """(n, c) values of the facets that hold directions (n, 3); NaN below the horizon."""
        i, r = facet_index(incident, self.level), facet_index(exit, self.level)
        return np.where(((i < 0) | (r < 0))[:, None], np.nan, self.values[i, r])

    def interpolate(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """(n, c) values, continuous in both directions (n, 3) and second order in the facets' size; NaN below.

        Each facet is cut into three triangles (barycentre, corner, corner). Inside one, f is linear between the
        values at barycentres and at corners, a corner's value being that of the plane fitted to the facets around
        it. Exact at barycentres; reciprocal if the matrix is.
        """
        (i, at_i), (r, at_r) = _weights(incident, self.level), _weights(exit, self.level)
        nodes = node_values(self.level, self.values)
        result = np.zeros((len(i), self.values.shape[2]))
        for a in range(3):
            for b in range(3):
                result += (at_i[:, a] * at_r[:, b])[:, None] * nodes[i[:, a], r[:, b]]
        return result

    def reciprocity_breach(self) -> np.ndarray:
        """(c,) root of the solid-angle weighted share of the matrix that is antisymmetric."""
        weight = np.multiply.outer(solid_angles(self.level), solid_angles(self.level))[..., None]
        odd = (self.values - self.values.transpose(1, 0, 2)) / 2
        return np.sqrt((weight * odd**2).sum((0, 1)) / (weight * self.values**2).sum((0, 1)))


def facet_matrix(brdf: Callable[[np.ndarray, np.ndarray], np.ndarray], level: int) -> FacetMatrix:
    """The matrix of a callable BRDF, at the facets' barycentres."""
    centres = barycentres(level)
    return FacetMatrix(level, brdf(centres[:, None], centres[None, :]))


def node_values(level: int, values: np.ndarray) -> np.ndarray:
    """(f + v, f + v, c) values at barycentres, then at corners, of a facet matrix (f, f, c)."""
    lift = _lift(level)
    count = lift.shape[1]
    half = (lift @ values.reshape(count, -1)).reshape(-1, count, values.shape[2])
    turned = half.transpose(1, 0, 2).reshape(count, -1)
    return (lift @ turned).reshape(-1, len(half), values.shape[2]).transpose(1, 0, 2)


def pair_classes(level: int, *, reciprocal: bool = True, isotropic: bool = True) -> np.ndarray:
    """(f, f) class of each facet pair: pairs of one class have one value under the symmetries asked for.

    Isotropic (with bilateral symmetry): equal theta_i, theta_r and |dphi|; reciprocal: i and r may change places.
    Classes are numbered from 0 in no set order.
    """
    count = facet_count(level)
    i, r = (x.ravel() for x in np.indices((count, count)))
    if reciprocal and not isotropic:
        keys = np.column_stack([np.minimum(i, r), np.maximum(i, r)])
    elif not isotropic:
        keys = np.column_stack([i, r])
    else:
        centres = barycentres(level)
        theta_i, theta_r, dphi = pair_angles(centres[i], centres[r])
        if reciprocal:
            theta_i, theta_r = np.minimum(theta_i, theta_r), np.maximum(theta_i, theta_r)
        keys = np.round(np.column_stack([theta_i, theta_r, np.abs(dphi)]) * 2**30).astype(np.int64)
    return np.unique(_merged(keys), axis=0, return_inverse=True)[1].reshape(count, count)


def _merged(keys: np.ndarray) -> np.ndarray:
    """Angles that differ by rounding alone, made equal column by column."""
    merged = np.empty_like(keys)
    for k, column in enumerate(keys.T):
        values, place = np.unique(column, return_inverse=True)
        merged[:, k] = (
            np.concatenate([[0], np.cumsum(np.diff(values) > 8)])[place] if keys.shape[1] == 3 else column
        )
    return merged


@lru_cache(maxsize=8)
def _corners(level: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (f, 3) of each facet's corners in the list of distinct ones, and that list (v, 3)."""
    flat = vertices(level).reshape(-1, 3)
    _, first, place = np.unique(np.round(flat * 2**24), axis=0, return_index=True, return_inverse=True)
    return place.reshape(-1, 3), flat[first]


@lru_cache(maxsize=8)
def _lift(level: int) -> csr_array:
    """(f + v, f) from values at barycentres to values there and at corners, by planes fitted around each corner."""
    place, corners = _corners(level)
    centres = barycentres(level)
    count = len(centres)
    rows, columns, shares = [np.arange(count)], [np.arange(count)], [np.ones(count)]
    touching = coo_array((np.ones(place.size), (place.ravel(), np.repeat(np.arange(count), 3)))).tocsr()
    wider = (
        touching @ touching.T @ touching
    )  # where a corner has too few facets, those of the corners next to it
    for corner, at in enumerate(corners):
        around = touching.indices[touching.indptr[corner] : touching.indptr[corner + 1]]
        if len(around) < 5:
            around = wider.indices[wider.indptr[corner] : wider.indptr[corner + 1]]
        share = _plane_weights(at, centres[around])
        rows.append(np.full(len(around), count + corner))
        columns.append(around)
        shares.append(share)
    entries = (np.concatenate(shares), (np.concatenate(rows), np.concatenate(columns)))
    return coo_array(entries, shape=(count + len(corners), count)).tocsr()


def _plane_weights(at: np.ndarray, around: np.ndarray) -> np.ndarray:
    """(k,) weights that give the value at ``at`` of the plane fitted by least squares to values at ``around``."""
    east = np.cross(at, [0.0, 0.0, 1.0] if abs(at[2]) < 0.9 else [1.0, 0.0, 0.0])
    east /= np.linalg.norm(east)
    design = np.column_stack([np.ones(len(around)), around @ east, around @ np.cross(at, east)])
    return np.linalg.pinv(design)[0]


@lru_cache(maxsize=8)
def _inverses(level: int) -> np.ndarray:
    """(f, 3, 3, 3) for each facet's triangles (barycentre, corner k, corner k + 1): directions to weights."""
    corners = vertices(level)
    centres = np.broadcast_to(barycentres(level)[:, None], corners.shape)
    return np.linalg.inv(np.stack([centres, corners, np.roll(corners, -1, 1)], axis=-1))


def _weights(directions: np.ndarray, level: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3) and weights (n, 3) of each direction; NaN below the horizon."""
    directions = np.asarray(directions, float)
    facet = facet_index(directions, level)
    held = np.maximum(facet, 0)
    every = np.einsum("ntkx,nx->ntk", _inverses(level)[held], np.nan_to_num(directions))
    best = every.min(2).argmax(1)
    row = np.arange(len(facet))
    weight = every[row, best]
    weight = weight / np.where(facet < 0, np.nan, weight.sum(1))[:, None]
    place = _corners(level)[0][held]
    count = facet_count(level)
    nodes = np.column_stack([held, count + place[row, best], count + place[row, (best + 1) % 3]])
    return nodes, weight
