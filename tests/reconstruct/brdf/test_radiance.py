"""Radiance's BSDF XML, against what Radiance's own library answers, and files that are not what they should be."""

import subprocess
import sys

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf import radiance
from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.brdf.radiance import parse_tree, read_radiance, tree_text
from photogonio.reconstruct.export import radiance_tree
from photogonio.reconstruct.export.radiance_klems import write_radiance_klems
from photogonio.reconstruct.export.radiance_tree import write_radiance_tree
from photogonio.reconstruct.modes.angles import unit_vectors

ASK = """
import json, sys
import pyradiance.bsdf as bsdf
sd = bsdf.load_file(sys.argv[1])
print(json.dumps([float(bsdf.query(sd, *pair)[1]) for pair in json.loads(sys.stdin.read())]))
"""


def satin(roughness=0.3) -> Brdf:
    lobe = Lobe(roughness, np.full(3, 0.04), np.ones(3))
    return Brdf(
        0,
        ("R", "G", "B"),
        np.array([[0, 0, 0]]),
        np.array([[0.6, 0.4, 0.2]]),
        np.zeros((1, 3)),
        lobes=(lobe,),
    )


def streaked() -> Brdf:
    """Changes as the sample turns, and with the sign of every azimuth."""
    modes = np.array([[0, 0, 0, 0], [2, 2, 2, 2], [1, 1, 1, 1], [2, 2, 2, -2]])
    return Brdf(
        2, ("Y",), modes, np.array([[1.0], [0.25], [0.2], [0.15]]), np.zeros((4, 1)), symmetry="general"
    )


def pairs(count: int, seed: int):
    rng = np.random.default_rng(seed)
    theta = np.arcsin(np.sqrt(rng.uniform(0.001, 0.95, (2, count))))
    phi = rng.uniform(-np.pi, np.pi, (2, count))
    return theta[0], phi[0], theta[1], phi[1]


@pytest.fixture
def coarse(monkeypatch):
    monkeypatch.setattr(radiance_tree, "_DEEPEST", {3: 6, 4: 3})
    monkeypatch.setattr(radiance_tree, "_FEW", 20_000)
    monkeypatch.setattr(radiance_tree, "_MOST", 20_000)


@pytest.mark.parametrize("write", [write_radiance_tree, write_radiance_klems])
@pytest.mark.parametrize("brdf", [satin(), streaked()], ids=["satin", "streaked"])
def test_radiance_itself_answers_the_same(tmp_path, coarse, write, brdf):
    import json

    pytest.importorskip("pyradiance", reason="pyradiance is not installed")
    path = tmp_path / "a.xml"
    write(brdf, path)
    angles = pairs(400, 1)
    given = json.dumps(np.degrees(np.column_stack(angles)).tolist())
    done = subprocess.run(
        [sys.executable, "-c", ASK, path], input=given, capture_output=True, text=True, check=True
    )
    there = np.array(json.loads(done.stdout))
    here = read_radiance(path).evaluate(unit_vectors(*angles[:2]), unit_vectors(*angles[2:]))[:, 0]
    # Radiance keeps its numbers as shares of a Lambertian part and colours as tristimulus: a few 1e-4; a direction
    # within rounding of a cell's edge may fall on either side of it
    assert np.mean(np.abs(here - there) <= 1e-3 * there + 1e-5) > 0.99


def test_a_block_is_the_same_as_its_cells(tmp_path):
    numbers = np.arange(1.0, 65.0)
    block = parse_tree(tmp_path, "{" + " ".join(map(str, numbers)) + "}", 3)

    def nested(cube):
        if cube.size == 1:
            return f"{{ {cube.item()} }}"
        n = len(cube) // 2
        halves = [
            cube[tuple(slice(n * (k >> a & 1), n * ((k >> a & 1) + 1)) for a in range(3))] for k in range(8)
        ]
        return "{" + "".join(nested(half) for half in halves) + "}"

    cells = parse_tree(tmp_path, nested(numbers.reshape(4, 4, 4)), 3)
    angles = pairs(300, 2)
    incident, exit = unit_vectors(*angles[:2]), unit_vectors(*angles[2:])
    np.testing.assert_array_equal(block(incident, exit), cells(incident, exit))
    assert (block(-incident, exit) == 0).all()


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "{ 1 } { 2 }",
        "{ { 1 } }",
        "{ 1 2 3 }",
        "{ x }",
        "{ nan }",
        "{}",
        "1",
        "}",
        "{ 1 { 2 } }",
        "{" * 40,
    ],
)
def test_trees_that_are_none_are_refused(tmp_path, text):
    with pytest.raises(InputError, match="tensor tree"):
        parse_tree(tmp_path / "a.xml", text, 3)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text[:200], "no XML"),
        (lambda text: "<html></html>", "no WindowElement"),
        (lambda text: text.replace("TensorTree3", "TensorTree7"), "tensor tree or"),
        (lambda text: text.replace("Reflection Back", "Transmission Front"), "no reflection"),
        (lambda text: "<!DOCTYPE a [<!ENTITY b 'c'>]>" + text, "entities"),
    ],
)
def test_other_files_are_refused_by_name(tmp_path, coarse, change, said):
    path = tmp_path / "a.xml"
    write_radiance_tree(satin(), path)
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError, match=said) as raised:
        read_radiance(path)
    assert "a.xml" in str(raised.value)


def test_no_file_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_radiance(tmp_path / "none.xml")


@pytest.mark.parametrize("axes", [3, 4])
def test_albedos_are_the_sums_of_cells(tmp_path, axes):
    """Of an even block: its numbers, times the projected solid angle of a cell, over the exit axes."""
    numbers = np.random.default_rng(axes).uniform(size=(4,) * axes)
    tree = parse_tree(tmp_path, "{" + " ".join(map(str, numbers.ravel())) + "}", axes)
    theta, phi = np.radians([10.0, 40.0, 80.0]), np.array([0.3, 2.0, -2.0])
    incident = unit_vectors(theta, phi)
    place = (4 * tree._places(incident, incident)[:, : axes - 2]).astype(int)
    expected = [np.pi / 16 * numbers[tuple(one)].sum() for one in place]
    np.testing.assert_allclose(tree.albedo(incident)[:, 0], expected, rtol=1e-12)


def test_albedos_of_a_matrix_are_its_columns_sums(tmp_path):
    write_radiance_klems(satin(), tmp_path / "a.xml")
    matrix = read_radiance(tmp_path / "a.xml").evaluate
    incident = unit_vectors(np.radians([7.0, 52.0]), np.array([0.1, 1.0]))
    rng = np.random.default_rng(0)
    theta, phi = np.arcsin(np.sqrt(rng.uniform(size=20_000))), rng.uniform(0, 2 * np.pi, 20_000)
    for one, albedo in zip(incident, matrix.albedo(incident)[:, 0], strict=True):
        f = matrix(np.broadcast_to(one, (len(theta), 3)), unit_vectors(theta, phi))[:, 0]
        assert np.pi * f.mean() == pytest.approx(albedo, abs=4 * np.pi * f.std() / np.sqrt(len(f)))


@pytest.mark.parametrize("axes", [3, 4])
def test_text_of_a_tree_is_read_as_it_was(tmp_path, axes, monkeypatch):
    """By the reader of our own form, and by that of all forms; of numbers of every size."""
    parts, rng = 2**axes, np.random.default_rng(axes)
    roots = 4 if axes == 3 else 1
    child = np.full(roots + 3 * parts, -1)
    child[0], child[roots + 1], child[roots + parts - 1] = roots, roots + parts, roots + 2 * parts
    value = 10.0 ** rng.uniform(-9, 6, len(child))
    value[-3:] = 0.0, 1.0, 0.25
    text = tree_text(child, value, axes)
    places = rng.uniform(size=(2, 500, 2)) * [0.49 * np.pi, 2 * np.pi]
    incident, exit = (unit_vectors(*one.T) for one in places)
    found = parse_tree(tmp_path, text, axes)(incident, exit)
    monkeypatch.setattr(radiance, "_quick", lambda text, axes: None)
    np.testing.assert_array_equal(parse_tree(tmp_path, text, axes)(incident, exit), found)
    told = found[found > 0.0]
    known = value[child < 0]
    nearest = np.abs(told[:, None] / np.where(known > 0.0, known, np.inf) - 1.0).min(axis=1)
    assert (nearest < 6e-5).all() and len(np.unique(told)) > 5
