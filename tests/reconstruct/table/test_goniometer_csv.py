"""Rows of a goniometer as a table of cells."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.modes.angles import pair_angles, unit_vectors
from photogonio.reconstruct.table.goniometer_csv import UNBINNED, GoniometerSamples, samples_table

INCIDENT, EXIT, TURN = np.radians([[10.0, 30.0, 30.0], [20.0, 40.0, 40.0], [90.0, 180.0, 170.0]])


def rows(sigma: np.ndarray | None) -> GoniometerSamples:
    value = np.array([[1.0], [2.0], [0.0]])
    return GoniometerSamples(INCIDENT, np.zeros(3), EXIT, TURN, value, sigma, ("f",))


def test_the_table_has_a_cell_a_row():
    sigma = np.array([[0.1], [0.3], [0.2]])
    table = samples_table(rows(sigma))
    assert (table.level, len(table)) == (UNBINNED, 3)
    np.testing.assert_allclose(table.variance / table.weight[:, None] ** 2, sigma**2)
    np.testing.assert_allclose(pair_angles(table.incident, table.exit), [INCIDENT, EXIT, TURN], atol=1e-14)


def test_without_sigma_no_errors_are_made_up():
    assert not samples_table(rows(None)).variance.any()


def test_directions_are_those_of_the_angles():
    np.testing.assert_allclose(rows(None).incident, unit_vectors(INCIDENT, 0.0), atol=1e-15)
    np.testing.assert_allclose(rows(None).exit, unit_vectors(EXIT, TURN), atol=1e-15)
