"""What may be told of a table: thresholds of the page are those that tell."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.goniometer.codes import ENTRIES
from photogonio.reconstruct.goniometer.doubts import doubts_of
from tests.drawn.goniometer import glossy, matte, measured, regular

LEAST = {entry.code: entry.least for entry in ENTRIES}


def told(table) -> dict[str, float]:
    return {one.code: one.amount for one in doubts_of(table, "brdf")}


def test_a_power_of_the_cosine_is_told_from_the_threshold_on():
    plain = measured(matte(0.5), regular(15.0, 15.0, 30.0), noise=0.002)
    least = LEAST["table-cosine"]
    for power, doubted in ((least - 0.05, False), (least + 0.05, True)):
        table = replace(plain, value=plain.value * np.cos(plain.theta_r)[:, None] ** power)
        assert ("table-cosine" in told(table)) == doubted
        assert not doubted or abs(told(table)["table-cosine"] - power) < 0.02


def test_a_peak_toward_the_lamp_is_told_from_the_threshold_on():
    for weight in (0.0, 0.002, 0.1):
        table = measured(glossy(0.3, weight, 60.0, toward=1.0), regular(), noise=0.0)
        found = told(table)
        assert all(amount >= LEAST[code] for code, amount in found.items())
        assert ("table-lamp-side" in found) == (weight == 0.1)


def test_every_entry_says_what_it_means_and_what_to_do():
    assert all(entry.means.endswith(".") and entry.advice for entry in ENTRIES)
    assert all(entry.source for entry in ENTRIES if entry.least)
