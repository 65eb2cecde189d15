"""MERL's binary, read again."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import read_merl
from photogonio.reconstruct.export.formats import FORMATS
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.basis import isotropic_modes, reciprocal_modes
from photogonio.reconstruct.modes.mirror_quadrature import scattered_around
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


@pytest.mark.parametrize("roughness", [0.15, 0.06])
def test_bins_add_no_light_toward_grazing(tmp_path, roughness):
    """A gloss rises by per cents over a bin: its reader has the bin's one value from the lower edge on."""
    ones = np.ones(3)
    lobe = Lobe(roughness, np.array([0.9, 0.7, 0.4]), ones)
    brdf = Brdf(0, ("R", "G", "B"), isotropic_modes(0), 0.3 * ones[None], np.zeros((1, 3)), lobes=(lobe,))
    FORMATS["merl"].write(brdf, tmp_path / "a.binary")
    found = read_merl(tmp_path / "a.binary")
    for angle in np.radians([0.5, 40.1, 78.2, 84.1, 86.05, 87.03]):
        exit, weight = scattered_around(angle, 30_000)
        incident = np.broadcast_to(unit_vectors(angle, 0.0), exit.shape)
        added = weight @ found.evaluate(incident, exit) / (weight @ brdf(incident, exit)) - 1.0
        assert (added < 0.005).all() and (added > -0.05).all()
