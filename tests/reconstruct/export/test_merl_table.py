"""MERL's binary, read again."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import read_merl
from photogonio.reconstruct.export.formats import FORMATS
from photogonio.reconstruct.modes.basis import reciprocal_modes
from tests.drawn.exports import random_pairs, satin


def test_merl_keeps_channels_by_name(tmp_path):
    brdf = satin(("B", "G", "R"))
    FORMATS["merl"].write(brdf, tmp_path / "a.binary")
    incident, exit = random_pairs(300)
    found = read_merl(tmp_path / "a.binary").evaluate(incident, exit)
    # a bin is a degree or two wide, and this lobe 0.3 rad
    np.testing.assert_allclose(found, brdf(incident, exit)[:, ::-1], rtol=0.1)


@pytest.mark.parametrize(
    "brdf",
    [
        satin(("A", "B")),
        Brdf(0, ("Y",), reciprocal_modes(0), np.ones((1, 1)), np.zeros((1, 1)), symmetry="reciprocal"),
    ],
    ids=["two channels", "not isotropic"],
)
def test_what_it_cannot_hold_is_refused(tmp_path, brdf):
    with pytest.raises(InputError, match="--format merl"):
        FORMATS["merl"].write(brdf, tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


def test_one_channel_is_repeated(tmp_path):
    FORMATS["merl"].write(satin(("Y",)), tmp_path / "a.binary")
    found = read_merl(tmp_path / "a.binary").evaluate(*random_pairs(5))
    np.testing.assert_allclose(found[:, 0], found[:, 2], rtol=1e-12)
