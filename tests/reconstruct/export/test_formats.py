"""Formats by name."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.export.formats import FORMATS, find_format
from tests.drawn.exports import satin


def test_an_unknown_format_is_refused():
    with pytest.raises(InputError, match="csv, merl, mitsuba, radiance, openpbr, gltf, modes, scatmech"):
        find_format("obj")


def test_a_basis_is_radiances_alone():
    assert find_format("radiance", "klems").write is not find_format("radiance", "tree").write
    assert find_format("radiance").write is find_format("radiance", "tree").write
    with pytest.raises(InputError, match="--basis klems: --format merl has none"):
        find_format("merl", "klems")


def test_what_is_not_read_back_has_no_loss_and_what_keeps_every_digit_none_to_speak_of(tmp_path):
    FORMATS["modes"].write(satin(), tmp_path / "a.json")
    assert FORMATS["csv"].loss(satin(), tmp_path / "a.csv") is None
    loss = FORMATS["modes"].loss(satin(), tmp_path / "a.json")
    assert max(loss.rms) < 1e-12
    np.testing.assert_allclose(loss.albedo, 1.0, rtol=1e-12)


def test_suffixes_are_those_that_consumers_look_for():
    suffixes = {name: form.suffix for name, form in FORMATS.items()}
    assert suffixes["mitsuba"] == ".bsdf" and suffixes["openpbr"] == ".mtlx" and suffixes["merl"] == ".binary"
    assert all(suffix.startswith(".") for suffix in suffixes.values())


def test_no_two_formats_take_the_same_name_nor_that_of_a_result():
    suffixes = [form.suffix for form in FORMATS.values()]
    assert len(set(suffixes)) == len(suffixes) and ".json" not in suffixes
