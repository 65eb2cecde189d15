"""SCATMECH's coefficient file, read again."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.scatmech import read_scatmech, scatmech_brdf
from photogonio.reconstruct.export.formats import FORMATS
from tests.drawn.exports import coated, rms_between, satin


def test_scatmech_keeps_every_digit(tmp_path):
    brdf = satin(("Y",), lobes=False)
    FORMATS["scatmech"].write(brdf, tmp_path / "a.csv")
    table = read_scatmech(tmp_path / "a.csv")
    assert table.unpolarised.all()
    np.testing.assert_array_equal(np.sort(table.values), np.sort(brdf.coefficients[:, 0]))


def test_scatmechs_modes_stand_for_lobes_and_what_they_lose_is_said(tmp_path):
    said = FORMATS["scatmech"].write(coated(), tmp_path / "s.csv", order=12)
    found = scatmech_brdf(read_scatmech(tmp_path / "s.csv"))
    assert not found.lobes and found.order == 12
    assert "modes to order 12 lose" in said
    assert rms_between(found, coated()) < 0.02
    with pytest.raises(InputError, match="--order 1"):
        FORMATS["scatmech"].write(satin(("Y",)), tmp_path / "s.csv", order=1)


def test_several_channels_are_refused(tmp_path):
    with pytest.raises(InputError, match="--format scatmech: holds one channel"):
        FORMATS["scatmech"].write(satin(lobes=False), tmp_path / "a")
    assert list(tmp_path.iterdir()) == []
