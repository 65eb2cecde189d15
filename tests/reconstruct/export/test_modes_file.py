"""The first version of the coefficient file, and what it loses."""

from __future__ import annotations

import re

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.export.formats import FORMATS
from photogonio.reconstruct.export.modes_file import TOLD, loss_in_words
from tests.drawn.exports import coated, rms_between, satin


def test_modes_are_version_1_at_the_order_asked_and_the_loss_is_true(tmp_path):
    losses = []
    for order in (2, 8):
        said = FORMATS["modes"].write(coated(), tmp_path / "m.json", order=order)
        found = load_brdf(tmp_path / "m.json")
        assert found.version == 1 and found.order == order and "coat" not in (tmp_path / "m.json").read_text()
        losses.append(rms_between(found, coated()))
        # two digits are told, and the pairs are random
        stated = float(re.search(r"lose ([\d.e-]+) % of f", said)[1]) / 100.0
        assert losses[-1] == pytest.approx(stated, rel=0.12)
    assert losses[1] < losses[0] < 0.05
    assert FORMATS["modes"].write(satin(), tmp_path / "m.json") is None  # version 1 knows all of it
    assert load_brdf(tmp_path / "m.json").evaluate(0.3, 0.0, 0.9, 2.0) == pytest.approx(
        satin().evaluate(0.3, 0.0, 0.9, 2.0), rel=1e-12
    )


def test_a_loss_is_told_by_channel_and_rounding_is_none():
    assert loss_in_words(np.array([0.5 * TOLD, 0.0]), ("R", "G"), 4) is None
    said = loss_in_words(np.array([0.001, 0.0123]), ("R", "G"), 4)
    assert said == "modes to order 4 lose 1.2 % of f, rms below 70 degrees (R 0.1, G 1.2 %)"
