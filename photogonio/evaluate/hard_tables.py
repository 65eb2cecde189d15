"""Hard cases that are tables, not photos: sums of very many samples and very uneven weights, against exact numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np

from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.facet_table import FacetTable, accumulate, add_tables
from photogonio.reconstruct.table.facets import facet_index
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table

# A sum of n numbers in turn errs by at most n / 2 ulp of the largest partial sum, and by chance by sqrt(n) of it
# (Higham, Accuracy and Stability of Numerical Algorithms, 4.2): a block of a million by 1e-13 of itself.
LOST = 1e-12  # of a sum, at most
_BLOCK = 1_000_000
_DIRECTION = np.array([[0.3, 0.1, math.sqrt(0.9)]])


def spread_of_weights() -> tuple[bool, str]:
    """Samples of weights from 1e-6 to 1: their sums in one cell, and a fit of errors that spread as widely."""
    lost = _lost_among_weights()
    rng = np.random.default_rng(7)
    theta, phi = np.arccos(rng.uniform(0.2, 1.0, (2, 3000))), rng.uniform(0.0, 2 * np.pi, (2, 3000))
    sigma = 10.0 ** rng.uniform(-8.0, -2.0, (3000, 1))
    value = 0.5 / np.pi + sigma * rng.standard_normal((3000, 1))
    table = samples_table(GoniometerSamples(theta[0], phi[0], theta[1], phi[1], value, sigma, ("Y",)))
    fit = fit_table(table, FitOptions(order=4, lobes=0))
    off = np.abs(fit.brdf(unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])) * np.pi / 0.5 - 1)
    said = f"sums off by {lost:.1e}; of a fit of standard errors from 1e-8 to 1e-2 the largest error {off.max():.1e}"
    return bool(off.max() < 1e-4 and lost < LOST), said


def _lost_among_weights() -> float:
    """A cell of a million samples of weights from 1e-6 to 1 with the light ones last, when the sums are largest."""
    rng = np.random.default_rng(8)
    omega = np.sort(10.0 ** rng.uniform(-6.0, 0.0, _BLOCK))[::-1]
    value = rng.uniform(0.01, 1.0, _BLOCK)
    cell = one_cell(omega, value)
    exact = (math.fsum(omega), math.fsum(omega * value), math.fsum(omega * value**2))
    sums = (cell.weight[0], cell.value[0, 0], cell.value2[0, 0])
    return max(abs(got / want - 1.0) for got, want in zip(sums, exact, strict=True))


def a_billion_samples() -> tuple[bool, str]:
    """10^9 samples in one cell: four photos' worth of a million real samples, over and over, in a thousand tables.

    The exact sums are rational numbers: a float is one, and so is a whole multiple of it.
    """
    rng = np.random.default_rng(9)
    blocks = [10.0 ** rng.uniform(-3.0, 0.0, _BLOCK) for _ in range(4)]
    cells = [one_cell(np.ones(_BLOCK), block) for block in blocks]
    total = add_tables(cells * 250)
    exact = 250 * sum((Fraction(math.fsum(block)) for block in blocks), Fraction(0))
    squares = 250 * sum((Fraction(math.fsum(block**2)) for block in blocks), Fraction(0))
    lost = max(
        abs(float(Fraction(float(got)) / want - 1))
        for got, want in ((total.value[0, 0], exact), (total.value2[0, 0], squares))
    )
    whole = len(total) == 1 and int(total.count[0]) == int(total.weight[0]) == 1000 * _BLOCK
    # one sample more must still count, to the last bit that the sum holds
    more = total + one_cell(np.ones(1), np.array([0.25]))
    gained = float(more.value[0, 0] - total.value[0, 0])
    counted = int(more.count[0]) == 1000 * _BLOCK + 1 and abs(gained - 0.25) <= np.spacing(total.value[0, 0])
    said = f"{total.count[0]:.0e} samples in one cell, sums off by {lost:.1e}; one of 0.25 more adds {gained:.9f}"
    return bool(whole and counted and lost < LOST), said


def one_cell(omega: np.ndarray, value: np.ndarray) -> FacetTable:
    """A table of one cell from samples of weights (n,) and values (n,)."""
    n = len(omega)
    direction = np.repeat(_DIRECTION, n, axis=0)
    facet = np.repeat(facet_index(_DIRECTION, 3), n)
    return accumulate(
        level=3,
        channels=("Y",),
        name="one",
        isotropic=False,
        facet_i=facet,
        facet_r=facet,
        incident=direction,
        exit=direction,
        place=np.zeros((n, 3)),
        omega=omega,
        value=value[:, None],
        variance=np.full((n, 1), 1e-6),
    )


TABLE_CASES: dict[str, tuple[str, Callable[[], tuple[bool, str]]]] = {
    "weights-spread-1e6": ("no loss in the sums, and the fit stays within its errors", spread_of_weights),
    "1e9-samples-in-a-cell": ("no loss in the sums", a_billion_samples),
}
