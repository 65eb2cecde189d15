"""The cells of a table as a fit sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.reduce.directions import CANONICAL_AZIMUTH, canonical
from photogonio.reconstruct.table.cells import LEAST_SAMPLES, Cells, cells_of, few_of
from photogonio.reconstruct.table.facet_table import FacetTable, accumulate
from photogonio.reconstruct.table.facets import facet_index
from photogonio.reconstruct.table.goniometer_csv import samples_table
from tests.drawn.goniometer import SATIN, measured, scattered

SPREAD = 0.02  # radians


def one_cell(
    incident: np.ndarray, exit: np.ndarray, *, canonical: bool = False, level: int = 1
) -> FacetTable:
    """A table whose samples are all in one pair of facets."""
    n = len(incident)
    return accumulate(
        level=level,
        channels=("Y",),
        name="a",
        isotropic=canonical,
        incident=incident,
        exit=exit,
        facet_i=np.full(n, facet_index(incident[:1], level)[0]),
        facet_r=np.full(n, facet_index(exit[:1], level)[0]),
        place=np.zeros((n, 3)),
        omega=np.full(n, 2.0),
        value=np.linspace(0.1, 0.3, n)[:, None],
        variance=np.full((n, 1), 1e-4),
    )


def turned(direction: np.ndarray, axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(n, 3) a direction turned about an axis, to second order in the angles."""
    cross = np.cross(axis, direction)
    return direction + angle[:, None] * cross + 0.5 * angle[:, None] ** 2 * np.cross(axis, cross)


def test_means_are_those_of_the_samples():
    towards = unit_vectors(np.array([0.4, 0.5, 0.45]), np.array([0.1, 0.1, 0.2]))
    back = unit_vectors(np.array([0.9, 0.9, 1.0]), np.array([2.0, 2.1, 2.0]))
    (cell,) = [cells_of(one_cell(towards, back))]
    assert len(cell) == 1 and cell.count[0] == 3 and cell.binned
    assert cell.value[0, 0] == pytest.approx(0.2) and cell.variance[0, 0] == pytest.approx(1e-4 / 3)
    mean = towards.mean(0) / np.linalg.norm(towards.mean(0))
    np.testing.assert_allclose(unit_vectors(cell.theta_i, cell.phi_i)[0], mean, atol=1e-12)


def test_cells_of_few_pixels_are_left_out_and_single_measurements_are_not():
    for n, kept in ((LEAST_SAMPLES - 1, 0), (LEAST_SAMPLES, 1)):
        towards = unit_vectors(np.full(n, 0.4), np.full(n, 0.1))
        assert len(cells_of(one_cell(towards, towards))) == kept
    rows = cells_of(samples_table(measured(SATIN, scattered(7))))
    assert len(rows) == 7 and not rows.binned and rows.turn is None


def test_angles_are_folded_and_rows_taken_whole():
    rng = np.random.default_rng(0)
    phi_i, phi_r = rng.uniform(-7.0, 7.0, (2, 20))
    theta = rng.uniform(0.0, 1.5, 20)
    cells = Cells.of_directions(theta, phi_i, theta, phi_r)
    np.testing.assert_allclose(np.cos(cells.dphi), np.cos(phi_r - phi_i), atol=1e-12)
    assert ((cells.dphi >= 0.0) & (cells.dphi <= np.pi)).all()
    doubted = replace(cells, doubt=np.arange(20.0)[:, None], value=np.ones((20, 1)))
    few = doubted.take(np.array([3, 5]))
    np.testing.assert_array_equal(few.doubt, [[3.0], [5.0]])
    assert len(few) == 2 and few.lamp is None and few.value.shape == (2, 1)


def test_lamps_variances_are_those_of_their_views():
    cells = replace(Cells.of_angles(*np.full((3, 4), 0.3)), group=np.array([0, 2, 1, 2]))
    assert cells.under(None) is cells
    np.testing.assert_array_equal(cells.under(np.array([1.0, 2.0, 3.0])).lamp, [1.0, 3.0, 2.0, 3.0])


def test_the_spread_of_a_balls_normals_within_a_cell_is_found():
    """Both directions turn together by small turns about both tangent axes of known variance. Of n samples a variance
    is known to sqrt(2 / n), and what falls short of unit vectors is right to the fourth power of the angles."""
    n = 4000
    rng = np.random.default_rng(1)
    along, across = SPREAD * rng.normal(size=(2, n))
    x, y = np.eye(3)[:2]
    pairs = [
        turned(turned(unit_vectors(theta, phi), x, along), y, across)
        for theta, phi in ((0.6, 0.3), (0.9, 2.2))
    ]
    pairs = [one / np.linalg.norm(one, axis=1, keepdims=True) for one in pairs]
    (turn,) = cells_of(one_cell(*pairs, level=0 + 1)).turn
    np.testing.assert_allclose(turn, SPREAD**2, rtol=5.0 * np.sqrt(2.0 / n) + 10.0 * SPREAD**2)


def test_the_spread_is_found_as_well_where_the_incident_azimuth_was_taken_out():
    """As before, after both directions were turned about the normal to one incident azimuth."""
    n = 4000
    rng = np.random.default_rng(2)
    along, across = 0.5 * SPREAD * rng.normal(size=n), SPREAD * rng.normal(size=n)
    x, y = np.eye(3)[:2]
    towards, back = (
        turned(turned(unit_vectors(theta, phi), x, along), y, across)
        for theta, phi in ((0.8, 0.0), (0.6, 1.9))
    )
    turn = -np.arctan2(towards[:, 1], towards[:, 0]) + CANONICAL_AZIMUTH
    both = [
        unit_vectors(np.arctan2(np.hypot(v[:, 0], v[:, 1]), v[:, 2]), np.arctan2(v[:, 1], v[:, 0]) + turn)
        for v in (towards, back)
    ]
    (found,) = cells_of(one_cell(*both, canonical=True)).turn
    expected = [(0.5 * SPREAD) ** 2, SPREAD**2]
    assert (np.abs(found / expected - 1.0) < 5.0 * np.sqrt(2.0 / n) + 10.0 * SPREAD**2).all()


def beside_the_lamp(spread: float = 0.14, n: int = 201) -> tuple[np.ndarray, np.ndarray]:
    """Canonical pairs of a ball whose normal moves from lamp to camera, 20 degrees apart, about 50 degrees off both."""
    off, turn, half = np.radians(50.0), np.linspace(-1.7, 1.7, n) * spread, np.radians(10.0)
    normal = np.column_stack(
        [np.full(n, np.sin(off)), np.cos(off) * np.sin(turn), np.cos(off) * np.cos(turn)]
    )
    lamp, camera = (np.tile([0.0, side * np.sin(half), np.cos(half)], (n, 1)) for side in (-1.0, 1.0))
    return canonical(lamp, camera, normal)


def test_lamp_and_camera_stand_apart_by_their_angle_however_wide_a_cell_is():
    cells = cells_of(one_cell(*beside_the_lamp(), canonical=True))
    known = cells.with_phase(np.full(1, np.cos(np.radians(20.0))))

    def apart(cells: Cells) -> float:
        pair = unit_vectors(cells.theta_i, cells.phi_i), unit_vectors(cells.theta_r, cells.phi_r)
        return float(np.degrees(np.arccos(np.sum(pair[0] * pair[1]))))

    assert apart(cells) < 19.9 and apart(known) == pytest.approx(20.0, abs=1e-9)
    assert known.dphi[0] == pytest.approx(abs(known.phi_r - known.phi_i)[0], abs=1e-12) and known.rigid
    np.testing.assert_array_equal([known.theta_i, known.theta_r], [cells.theta_i, cells.theta_r])
    upright = Cells.of_angles(np.zeros(1), np.full(1, 0.3), np.full(1, 0.7)).with_phase(np.full(1, 0.9))
    assert upright.dphi[0] == 0.7  # means nothing, and stays


def test_what_is_read_at_one_pair_has_no_spread():
    towards, back = (unit_vectors(np.full(9, t), np.full(9, p)) for t, p in ((0.6, 0.3), (0.9, 2.2)))
    for folded in (False, True):
        turn = cells_of(one_cell(towards, back, canonical=folded)).turn
        np.testing.assert_allclose(turn, 0.0, atol=1e-12)


def test_channels_are_taken_evenly_and_with_all_that_is_theirs():
    assert few_of(3, 6).tolist() == [0, 1, 2] and few_of(1, 6).tolist() == [0]
    some = few_of(31, 6)
    assert some.tolist() == [0, 6, 12, 18, 24, 30]
    cells = cells_of(samples_table(measured(SATIN, scattered(40))))
    rng = np.random.default_rng(0)
    wide = replace(
        cells,
        value=rng.random((40, 31)),
        variance=rng.random((40, 31)),
        doubt=rng.random((40, 31)),
        channels=tuple(str(k) for k in range(31)),
    )
    found = wide.of_channels(some)
    assert found.channels == ("0", "6", "12", "18", "24", "30")
    for name in ("value", "variance", "doubt"):
        assert np.array_equal(getattr(found, name), getattr(wide, name)[:, some])
    assert wide.of_channels(np.arange(2)).doubt.shape == (40, 2)
    assert replace(wide, doubt=None).of_channels(some).doubt is None
