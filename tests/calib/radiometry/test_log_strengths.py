"""The linear model of log strengths: least squares where all agree, and without the row that contradicts the others."""

import numpy as np
import pytest

from photogonio.calib.radiometry.log_strengths import LogReading, solve

STRENGTHS = {f"{k}.png": np.array([1.0, 0.5, -0.3]) + 0.2 * k for k in range(8)}
PAPER = np.array([-0.2, -0.21, -0.25])


def rows(
    patch_error: float, paper_error: float, seed: int | None = None, *, doubted: bool = True
) -> list[LogReading]:
    """Patch and paper of every view, with normal errors of the sizes stated, or none."""
    rng = np.random.default_rng(seed)
    made = []
    for name, strength in STRENGTHS.items():
        for unknowns, value, error in (
            ((name,), strength, patch_error),
            ((name, "paper"), strength + PAPER, paper_error),
        ):
            noise = 0.0 if seed is None else error * rng.normal(size=3)
            made.append(
                LogReading(unknowns, value + noise, np.full(3, error), doubted and len(unknowns) == 1)
            )
    return made


def test_rows_without_errors_give_all_unknowns():
    found = solve(rows(0.01, 0.02))
    for name, value in (STRENGTHS | {"paper": PAPER}).items():
        np.testing.assert_allclose(found.value[name], value, atol=1e-12)


def test_values_and_errors_are_those_of_least_squares():
    """Against numpy's solver, on rows divided by their errors; errors from the pseudoinverse of that design."""
    told = rows(0.01, 0.02, seed=3, doubted=False)
    found = solve(told)
    names = list(found.value)
    design = np.array([[float(n in row.unknowns) for n in names] for row in told])
    error = np.array([row.error[0] for row in told])
    scaled = design / error[:, None]
    for channel in range(3):
        value = np.array([row.value[channel] for row in told]) / error
        expected = np.linalg.lstsq(scaled, value, rcond=None)[0]
        np.testing.assert_allclose([found.value[n][channel] for n in names], expected, rtol=1e-9)
    sigma = np.linalg.norm(np.linalg.pinv(scaled), axis=1)
    np.testing.assert_allclose([found.error[n][0] for n in names], sigma, rtol=1e-9)


@pytest.mark.parametrize("doubted", [False, True])
def test_stated_errors_are_those_that_are_made(doubted):
    """Standardised errors of 60 draws of 8 views, whose rms is 1 within three of its own errors (one channel counted).
    Weights below 1 leave less certainty than there is: Tukey's are 0.8 in the mean where errors are normal."""
    z = []
    for seed in range(60):
        found = solve(rows(0.01, 0.02, seed, doubted=doubted))
        z += [(found.value[n] - value) / found.error[n] for n, value in STRENGTHS.items()]
    rms, own = np.sqrt(np.mean(np.square(z))), 1 / np.sqrt(2 * 60 * 8)
    assert (np.sqrt(0.8) if doubted else 1.0) - 3 * own < rms < 1 + 3 * own


@pytest.mark.parametrize("off", [-0.5, 0.2, 2.0])
def test_a_doubted_row_that_contradicts_the_others_does_not_count(off):
    told = rows(0.01, 0.02)
    told[4] = LogReading(told[4].unknowns, told[4].value + off, told[4].error, doubted=True)
    found = solve(told)
    # it keeps a weight of 1e-6, and there are at most 8 of the others'
    for name, value in (STRENGTHS | {"paper": PAPER}).items():
        np.testing.assert_allclose(found.value[name], value, atol=1e-5 * abs(off))


def test_a_row_that_is_not_doubted_counts_however_far_it_lies():
    told = rows(0.01, 0.02, doubted=False)
    told[4] = LogReading(told[4].unknowns, told[4].value + 0.3, told[4].error)
    assert np.abs(solve(told).value["2.png"] - STRENGTHS["2.png"]).min() > 0.1


def test_lamps_that_are_one_share_their_readings():
    """n readings of one lamp: each view's error falls by the root of n, and an odd one is left to itself."""
    views = [f"{k}" for k in range(16)]
    same = [LogReading((n, "given"), np.zeros(1), np.full(1, 1e-4), doubted=True) for n in views]
    own = [LogReading((n,), np.full(1, 0.2 if n == "3" else 0.0), np.full(1, 0.01)) for n in views]
    found = solve([*own, *same])
    assert found.error["5"][0] == pytest.approx(0.01 / np.sqrt(15), rel=0.02)
    # what is left of its say: a weight of 1e-6, so an error of 0.1 against the others' 0.01, one of 16
    np.testing.assert_allclose(
        [found.value[n][0] for n in views if n != "3"], 0.0, atol=0.2 * 0.01 / 15 * 1.1
    )
    assert found.value["3"][0] == pytest.approx(0.2, abs=0.2 * 0.01)
    assert found.error["3"][0] == pytest.approx(0.01, rel=0.02)


def test_all_doubted_rows_contradicting_one_another_still_give_an_answer():
    told = [LogReading(("a",), np.array([k * 1.0]), np.array([1e-3]), doubted=True) for k in (0, 1)]
    assert 0.0 <= solve(told).value["a"][0] <= 1.0
