"""One adjustment of everything: camera, poses, lamps, mirror balls and sample, from corners, highlights, limbs and
shading together (Triggs et al., "Bundle adjustment: a modern synthesis", 2000).

Values live in one vector, cut into named blocks. Every term gives its residuals, in standard errors, and their
derivatives by block; the sparse least squares is SciPy's, robust on what may be wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import aslinearoperator

from photogonio.calib.adjust.bearing import Bearing

_ROBUST = 3.0  # standard errors beyond which a robust row counts less
_ROUNDS = 50

Values = dict[str, np.ndarray]
Derivatives = dict[str, np.ndarray]
Term = Callable[[Values], tuple[np.ndarray, Derivatives]]


@dataclass(frozen=True, slots=True)
class Part:
    """Some values of a block, mapped: ``turn @ block[where] + shift``."""

    block: str
    where: slice
    turn: np.ndarray | None = None
    shift: np.ndarray | None = None
    bearing: Bearing | None = None  # of a place: the part is how it is seen

    def value(self, values: Values) -> np.ndarray:
        taken = self._taken(values)
        return taken if self.bearing is None else self.bearing.seen(taken)

    def slope(self, values: Values, piece: np.ndarray) -> np.ndarray:
        """Derivative (k, n) by the block's values of what changes by ``piece`` (k, m) with :meth:`value`."""
        piece = piece if self.bearing is None else piece @ self.bearing.by_place(self._taken(values))
        return piece if self.turn is None else piece @ self.turn

    def _taken(self, values: Values) -> np.ndarray:
        taken = values[self.block][self.where]
        return taken if self.turn is None else self.turn @ taken + self.shift


def quadratic_term(parts: Sequence[Part], at: np.ndarray, normal: np.ndarray, slope: np.ndarray) -> Term:
    """A term known by its information matrix and gradient at ``at``, the values of ``parts`` in a row."""
    size, axes = np.linalg.eigh((normal + normal.T) / 2)
    strong = size > 1e-10 * size.max()
    root = np.sqrt(size[strong])
    rows = root[:, None] * axes[:, strong].T
    start = (axes[:, strong].T @ slope) / root

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        now = np.concatenate([p.value(values) for p in parts])
        derivatives: Derivatives = {}
        column = 0
        for p in parts:
            width = len(values[p.block][p.where])
            piece = rows[:, column : column + width]
            whole = derivatives.setdefault(p.block, np.zeros((len(rows), len(values[p.block]))))
            whole[:, p.where] += p.slope(values, piece)
            column += width
        return start + rows @ (now - at), derivatives

    return term


def prior_term(name: str, mean: np.ndarray, sigma: np.ndarray) -> Term:
    """A block expected at ``mean`` within ``sigma``."""

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        return (values[name] - mean) / sigma, {name: np.diag(1 / np.asarray(sigma, float))}

    return term


def expected_term(name: str, mean: np.ndarray, root: np.ndarray) -> Term:
    """A block expected at ``mean`` (d,); ``root`` (d, d) times what it is off is in standard errors."""

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        return root @ (values[name] - mean), {name: root}

    return term


@dataclass(frozen=True, slots=True)
class Adjusted:
    """The result of one adjustment."""

    values: Values
    covariance: dict[str, np.ndarray]  # of each block, the others free
    residuals: list[np.ndarray]  # of each term, in standard errors
    cost: float


def adjust(
    start: Values,
    terms: Sequence[tuple[Term, bool]],
    fixed: frozenset[str] = frozenset(),
    middle: np.ndarray | None = None,
    places: Sequence[str] = (),
) -> Adjusted:
    """Least squares over all blocks but the ``fixed`` ones; each term comes with whether its loss is robust. ``places``
    are sought as they are seen from the ``middle`` (3,): some may be far away."""
    names = [n for n in start if n not in fixed]
    edges = np.cumsum([0] + [len(start[n]) for n in names])
    place = {n: slice(edges[k], edges[k + 1]) for k, n in enumerate(names)}
    sizes = [len(t(start)[0]) for t, _ in terms]
    robust = np.repeat([r for _, r in terms], sizes)

    origin = np.concatenate([start[n] for n in names])

    latest: list[tuple[bytes, list[tuple[np.ndarray, Derivatives]]]] = []

    seen = {} if middle is None else {n: Bearing(middle, start[n]) for n in places if n in place}

    def unpack(x: np.ndarray) -> Values:
        return start | {n: seen[n].place(x[place[n]]) if n in seen else x[place[n]] for n in names}

    def slopes(x: np.ndarray) -> dict[str, np.ndarray]:
        return {n: one.by_seen(x[place[n]]) for n, one in seen.items()}

    def worked_out(x: np.ndarray) -> list[tuple[np.ndarray, Derivatives]]:
        """All terms; residuals and derivatives at the same place are asked for one after the other."""
        if not latest or latest[0][0] != x.tobytes():
            values = unpack(x)
            latest[:] = [(x.tobytes(), [term(values) for term, _ in terms])]
        return latest[0][1]

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([found for found, _ in worked_out(x)])

    def jacobian(x: np.ndarray) -> csr_matrix:
        return _assemble([one for _, one in worked_out(x)], sizes, place, int(edges[-1]), slopes(x))

    def loss(z: np.ndarray) -> np.ndarray:
        return _mixed_loss(z, robust)

    # in steps of the first Jacobian's Cholesky factor all directions weigh alike, and LSMR needs few iterations
    basis = _basis(_normal(jacobian(origin), residual(origin), robust))
    found = least_squares(
        lambda y: residual(origin + basis @ y),
        np.zeros(len(origin)),
        jac=lambda y: aslinearoperator(jacobian(origin + basis @ y)) @ aslinearoperator(basis),
        loss=loss,
        tr_solver="lsmr",
        ftol=1e-8,
        xtol=1e-9,
        max_nfev=_ROUNDS,
    )
    x = origin + basis @ found.x
    last = residual(x)
    inverse, slope = _inverse(_normal(jacobian(x), last, robust)), slopes(x)
    values = unpack(x)
    return Adjusted(
        {n: np.array(v) for n, v in values.items()},
        {n: _turned(inverse[place[n], place[n]], slope.get(n)) for n in names},
        np.split(last, np.cumsum(sizes)[:-1]),
        float(found.cost),
    )


def _turned(covariance: np.ndarray, slope: np.ndarray | None) -> np.ndarray:
    return covariance if slope is None else slope @ covariance @ slope.T


def _normal(jacobian: csr_matrix, residual: np.ndarray, robust: np.ndarray) -> np.ndarray:
    """Dense J' W J with the weights of the robust loss."""
    weight = _mixed_loss(residual**2, robust)[1]
    return (jacobian.T @ jacobian.multiply(weight[:, None])).toarray()


def _basis(normal: np.ndarray) -> np.ndarray:
    """Columns in which ``normal`` becomes the unit matrix."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    scaled = normal * scale * scale[:, None] + 1e-12 * np.eye(len(normal))
    return scale[:, None] * solve_triangular(cholesky(scaled, lower=True), np.eye(len(normal)), lower=True).T


def _mixed_loss(z: np.ndarray, robust: np.ndarray) -> np.ndarray:
    """SciPy's loss and its two derivatives, (3, n): Cauchy's on robust rows, plain squares on the others."""
    scaled = z / _ROBUST**2
    return np.array(
        [
            np.where(robust, _ROBUST**2 * np.log1p(scaled), z),
            np.where(robust, 1 / (1 + scaled), 1.0),
            np.where(robust, -1 / (_ROBUST**2 * (1 + scaled) ** 2), 0.0),
        ]
    )


def _inverse(normal: np.ndarray) -> np.ndarray:
    """Inverse of a normal matrix, scaled first so that units do not matter."""
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    return (
        scale[:, None] * np.linalg.pinv(normal * scale * scale[:, None], rcond=1e-14, hermitian=True) * scale
    )


def _assemble(
    parts: list[Derivatives],
    sizes: list[int],
    place: dict[str, slice],
    width: int,
    slopes: Mapping[str, np.ndarray],
) -> csr_matrix:
    """The sparse Jacobian; derivatives by a block in ``slopes`` go on by what it changes with."""
    rows, columns, entries = [], [], []
    top = 0
    for derivatives, size in zip(parts, sizes, strict=True):
        for name, matrix in derivatives.items():
            if name in place and size:
                matrix = matrix @ slopes[name] if name in slopes else matrix
                y, x = np.nonzero(matrix)
                rows.append(top + y)
                columns.append(place[name].start + x)
                entries.append(matrix[y, x])
        top += size
    flat = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    return csr_matrix(flat, shape=(top, width))
