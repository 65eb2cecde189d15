"""Readings that contradict the others are taken out, those given stay as they are; errors hold the scatter."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.radiometry.judge import believed
from photogonio.calib.radiometry.patch import NoStrength, Strength
from photogonio.calib.radiometry.readings import StrengthReadings
from photogonio.calib.remarks import Remarks

PAPER = 0.85 / np.pi
VALUE = np.array([3.0, 2.0, 1.0])


def strength(value: np.ndarray, error: float = 0.003) -> Strength:
    return Strength(value, error * value, np.zeros(3))


def readings(patches: np.ndarray, error: float = 0.003) -> dict[str, StrengthReadings]:
    """One view for each factor by which its patch is brighter than its paper says."""
    return {
        f"{k}.png": StrengthReadings(
            strength(one * VALUE, error), strength(PAPER * VALUE, error), strength(0.05 * VALUE)
        )
        for k, one in enumerate(patches)
    }


def test_a_patch_in_shadow_is_taken_out_of_a_copy():
    given = readings(np.array([1.0, 0.8, 1.0, 1.0, 1.0]))
    before, remarks = dict(given), Remarks()
    left = believed(given, remarks)
    assert given == before
    assert isinstance(left["1.png"].patch, NoStrength) and isinstance(left["1.png"].paper, Strength)
    assert remarks.codes() == ["patch-not-believed"]


@pytest.mark.parametrize("scatter", [0.001, 0.008])
def test_errors_are_as_large_as_patch_and_paper_scatter(scatter):
    stated = 0.002
    ratio = np.exp(scatter * np.random.default_rng(2).normal(size=400))
    left = believed(readings(ratio, stated), Remarks())
    wider = left["7.png"].patch.error[0] / left["7.png"].patch.value[0] / stated
    # two readings of one error each; a median of 400 sizes is sure to 6 %
    assert wider == pytest.approx(max(1.0, scatter / (np.sqrt(2) * stated)), rel=0.2)


def test_a_lone_pair_is_believed_as_it_is():
    given = readings(np.array([1.0]))
    assert believed(given, Remarks()) == given
    dark = replace(given["0.png"], patch=strength(0.5 * VALUE))
    assert isinstance(believed({"0.png": dark}, Remarks())["0.png"].patch, NoStrength)
