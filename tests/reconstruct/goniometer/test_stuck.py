"""Values at which an instrument stood still, among a surface's own that repeat."""

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.spoilt import find_spoilt
from photogonio.reconstruct.goniometer.stuck import stuck_suspects
from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.table.neighbours import places
from tests.drawn.goniometer import SATIN, matte, measured, regular, rough, scattered


def out_of(table) -> np.ndarray:
    found = find_spoilt(table)
    return np.unique(np.concatenate([one.rows for one in found])) if found else np.empty(0, int)


def frozen(table, rows: np.ndarray, value: float):
    table.value[rows] = value
    return table


@pytest.mark.parametrize("where", ["scattered", "run"])
@pytest.mark.parametrize("surface", [SATIN, rough(0.5)])
def test_a_frozen_reading_among_others_is_left_out(surface, where):
    at = regular() if where == "run" else scattered(600, 3)
    table = measured(surface, at, noise=0.02)
    rng = np.random.default_rng(1)
    rows = np.arange(300, 340) if where == "run" else np.sort(rng.choice(600, 40, replace=False))
    value = float(np.quantile(table.value, 0.6)) * 1.0001
    np.testing.assert_array_equal(out_of(frozen(table, rows, value)), rows)


@pytest.mark.parametrize("step", [0.0, 1e-3, 0.01])
@pytest.mark.parametrize("noise", [0.0, 0.002, 0.05])
def test_what_digits_and_plateaus_repeat_is_believed(noise, step):
    for surface in (matte(0.5), SATIN, rough(0.5)):
        table = measured(surface, regular(), noise=noise)
        if step:
            table.value[:] = np.round(table.value / step) * step
        assert not len(out_of(table))


def test_wide_cells_that_are_read_at_finer_steps_are_believed():
    """As those of a MERL file are: neighbours differ by the steps of cells, which looks like noise, and values come
    again to the last digit."""
    at = regular(7.5, 5.0, 15.0)
    cells = [np.floor(np.degrees(one) / 4.0) * 4.0 + 2.0 for one in half_difference(*_vectors(at))]
    faded = (
        0.2 * np.exp(-np.cos(np.radians(cells[1]))) * (1.0 + 0.003 * np.sin(9.0 * cells[0] + 5.0 * cells[2]))
    )
    table = measured(lambda *_: faded, at, noise=0.0)
    table.value[:, 0] = faded
    assert not len(out_of(table))


def _vectors(at: tuple[np.ndarray, ...]) -> tuple[np.ndarray, np.ndarray]:
    return unit_vectors(at[0], 0.0), unit_vectors(at[1], at[2])


def test_reciprocal_and_mirrored_twins_are_one_reading():
    theta_i, theta_r = np.radians(np.linspace(10.0, 70.0, 40)), np.radians(np.linspace(72.0, 20.0, 40))
    at = np.concatenate(
        [places(theta_i, theta_r, 0 * theta_i + 1), places(theta_r, theta_i, 0 * theta_i - 1)]
    )
    value = np.tile(np.random.default_rng(0).uniform(0.1, 0.2, 40), 2)
    assert not len(stuck_suspects(at, value))
    value[[3, 43, 8, 48, 13, 53, 20, 60]] = 0.15  # four pairs of directions
    np.testing.assert_array_equal(stuck_suspects(at, value), [0.15])


def test_rows_of_the_wrong_sign_are_left_out_and_noise_below_zero_is_not():
    table = measured(SATIN, scattered(600, 3), noise=0.05)
    rows = np.sort(np.random.default_rng(1).choice(600, 30, replace=False))
    table.value[rows] *= -1.0
    np.testing.assert_array_equal(out_of(table), rows)
    for constant in (0.2, 0.5, 1.0):  # of the value, everywhere
        noisy = measured(matte(0.05), scattered(600, 3), constant=constant * 0.05 / np.pi)
        assert constant < 0.5 or (noisy.value < 0.0).any()
        assert not len(out_of(noisy))


def test_a_large_table_is_judged_by_some_of_its_rows(monkeypatch):
    """A reading that froze is left out whole where only a tenth of its rows are asked of their neighbours."""
    table = measured(matte(0.5), scattered(4000), noise=0.01)
    rows = np.arange(0, 4000, 20)
    table = frozen(table, rows, 0.09)
    whole = out_of(table)
    monkeypatch.setattr("photogonio.reconstruct.goniometer.stuck.ASKED", 20)
    monkeypatch.setattr("photogonio.reconstruct.goniometer.stuck.TOLD", 800)
    np.testing.assert_array_equal(out_of(table), whole)
    assert set(rows) <= set(whole)


def test_chance_repeats_a_reading_three_times_now_and_then():
    """In a tenth of tables of 205 noisy readings, five digits each: none has stood still."""
    rng, claimed, repeated = np.random.default_rng(5), 0, 0
    for _ in range(1000):
        theta_i, theta_r = np.arccos(rng.uniform(0.2, 1.0, (2, 205)))
        value = 0.15 * (1.0 + 0.05 * rng.standard_normal(205))
        value[:40] *= rng.uniform(1.0, 4.0, 40)
        value = np.round(value, 5)
        repeated += np.unique(value, return_counts=True)[1].max() >= 3
        claimed += len(stuck_suspects(places(theta_i, theta_r, rng.uniform(0.1, 3.0, 205)), value)) > 0
    assert repeated > 50
    assert claimed <= 1  # one in 10^4 tables is asked: two of 1000 would come once in 200 times


@pytest.mark.parametrize("angle", ["phase", "half"])
def test_what_hangs_on_one_angle_alone_is_the_same_wherever_that_is(angle):
    """As a retro-reflector's lobe, or a facets' distribution, that was written out to nine digits."""
    at = regular(10.0, 5.0, 10.0)
    incident, exit = _vectors(at)
    half = incident + exit
    cosine = (incident * exit).sum(1) if angle == "phase" else half[:, 2] / np.linalg.norm(half, axis=1)
    table = measured(lambda *_: 0.1 + 0.5 * np.clip(cosine, 0.0, 1.0) ** 20, at, noise=0.0)
    table.value[:] = np.round(table.value, 9)
    assert not len(out_of(table))
