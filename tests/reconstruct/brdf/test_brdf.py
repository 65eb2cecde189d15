"""A BRDF: evaluation at angles and vectors, and its file, written whole or not at all."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.lobes.schlick import ggx
from photogonio.reconstruct.modes.angles import unit_vectors
from tests.drawn.brdfs import COATS, LISTS, MIRRORS, RETROS, brdf_of, directions, with_every_key


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match=r"absent\.json: "):
        load_brdf(tmp_path / "absent.json")
    for text in ("{", "[1, 2]", "null"):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(InputError, match=r"x\.json: "):
            load_brdf(tmp_path / "x.json")


def test_a_failed_save_leaves_the_old_file(tmp_path):
    path = tmp_path / "brdf.json"
    with_every_key().save(path)
    before = path.read_bytes()
    broken = with_every_key(extra={"object": object()})
    with pytest.raises(TypeError):
        broken.save(path)
    unwritable = with_every_key()
    values = unwritable.coefficients.copy()
    values[0, 0] = np.nan  # coefficients must be finite; only standard errors may be unknown
    with pytest.raises(ValueError, match="JSON"):
        Brdf(2, ("R", "G", "B"), unwritable.modes, values, values).save(path)
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize("symmetry", LISTS)
def test_call_on_vectors_is_evaluation_at_angles(symmetry):
    brdf = with_every_key(symmetry)
    angles = np.random.default_rng(4).uniform(0, 1.5, (4, 7, 3))
    called = brdf(unit_vectors(angles[0], angles[1]), unit_vectors(angles[2], angles[3]))
    assert called.shape == (7, 3, 3)
    assert called == pytest.approx(brdf.evaluate(*angles), rel=1e-11, abs=1e-11)
    assert brdf.evaluate(0.1, 0.2, angles[2], 0.0).shape == (7, 3, 3)
    assert brdf.evaluate(0.1, 0.2, 0.3, 0.4).shape == (3,)
    assert brdf.evaluate(np.empty(0), 0.0, 0.3, 0.4).shape == (0, 3)


def test_only_the_difference_of_azimuths_counts_if_isotropic():
    brdf = with_every_key()
    phi = np.linspace(0, 40, 50)
    assert np.abs(brdf.evaluate(0.7, phi, 1.0, phi + 0.5) - brdf.evaluate(0.7, 0.0, 1.0, 0.5)).max() < 1e-12


def test_a_brdf_of_lobes_alone(tmp_path):
    none = np.empty((0, 1))
    lobe = Lobe(0.2, np.array([0.5]), np.array([2.0]))
    brdf = Brdf(0, ("Y",), np.empty((0, 3), int), none, none, lobes=(lobe,))
    brdf.save(tmp_path / "l.json")
    back = load_brdf(tmp_path / "l.json")
    assert back.evaluate(0.3, 0, 0.4, 2.0) == pytest.approx(2 * ggx(0.3, 0.4, 2.0, 0.2, [0.5]), rel=1e-14)
    assert back.directional_albedo(0.5) == pytest.approx(lobe.directional_albedo(0.5))
    assert back.directional_albedo(np.empty(0)).shape == (0, 1)


def test_nothing_is_sent_from_below_the_surface_or_to_it():
    incident, exit = directions(50)
    brdf = brdf_of(*COATS[:1], *MIRRORS[:1], *RETROS[:1])
    below = exit * [1.0, 1.0, -1.0]
    assert (brdf(incident, below) == 0.0).all() and (brdf(below, incident) == 0.0).all()
    assert (brdf.evaluate(1.6, 0.0, 0.3, 0.0) == 0.0).all()
    assert np.isnan(brdf.evaluate(np.nan, 0.0, 0.3, 0.0)).all()


MODES = {"isotropic": [[0, 0, 0], [2, 0, 0]], "general": [[0, 0, 0, 0], [2, 0, 0, 0]]}


@pytest.mark.parametrize("symmetry", MODES)
def test_f_is_zero_below_the_horizon(symmetry):
    lobes = (Lobe(0.3, np.array([0.5]), np.array([1.0])),)
    modes = np.array(MODES[symmetry])
    brdf = Brdf(2, ("Y",), modes, np.ones((2, 1)), np.ones((2, 1)), symmetry=symmetry, lobes=lobes)
    rng = np.random.default_rng(0)
    incident, exit = rng.normal(size=(2, 500, 3))
    above = (incident[:, 2] > 0) & (exit[:, 2] > 0)
    f = brdf(incident, exit)[:, 0]
    assert (f[~above] == 0.0).all()
    assert (f[above] != 0.0).all()
    edge = brdf.evaluate(np.pi / 2, 0.0, np.array([np.pi / 2, 0.3]), 0.0)
    assert np.isfinite(edge).all() and edge[1, 0] != 0.0
    np.testing.assert_array_equal(brdf.directional_albedo(np.array([1.7, -1.7]), 0.0), 0.0)
    turned = brdf.directional_albedo(np.array([0.4]), np.pi + 0.2)  # the other side of the normal
    np.testing.assert_array_equal(brdf.directional_albedo(np.array([-0.4]), 0.2), turned)


def test_the_first_version_is_jsons_own_indented_text(tmp_path):
    lobe = Lobe(0.2, np.array([0.04]), np.ones(1))
    rows = np.array([[0, 0, 0], [1, 1, 1]])
    brdf = Brdf(
        1, ("Y",), rows, np.array([[1.0], [1e-9]]), np.array([[np.nan], [0.5]]), lobes=(lobe,), version=1
    )
    brdf = replace(brdf, extra={"lists": [["a,b],[c", {"d": [1, [2]]}], [[]]], "rest": [[1, [2]], [3]]})
    brdf.save(tmp_path / "a.json")
    text = (tmp_path / "a.json").read_text()
    assert text == json.dumps(json.loads(text), indent=1) + "\n"
    assert "\n  [\n   1,\n   1,\n   1\n  ]\n ],\n" in text
