"""BSDF XML as an independent writer puts it there: trees, matrices of all bases, colours."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.brdf.radiance_matrix import LATITUDES
from photogonio.reconstruct.modes.angles import unit_vectors

HEAD = (
    '<?xml version="1.0"?><WindowElement xmlns="http://windows.lbl.gov"><FileType>BSDF</FileType><Optical><Layer>'
    "<DataDefinition><IncidentDataStructure>{}</IncidentDataStructure></DataDefinition>"
)
BLOCK = (
    '<WavelengthData><Wavelength unit="Integral">{}</Wavelength><WavelengthDataBlock>'
    "<WavelengthDataDirection>{}</WavelengthDataDirection>{}<ScatteringDataType>BRDF</ScatteringDataType>"
    "<ScatteringData>{}</ScatteringData></WavelengthDataBlock></WavelengthData>"
)
TREE = "<AngleBasis>LBNL/Shirley-Chiu</AngleBasis>"


def written(tmp_path, structure: str, *blocks: str):
    path = tmp_path / "bsdf.xml"
    path.write_text(HEAD.format(structure) + "".join(blocks) + "</Layer></Optical></WindowElement>")
    return path


def klems(name: str) -> str:
    return f"<ColumnAngleBasis>{name}</ColumnAngleBasis><RowAngleBasis>{name}</RowAngleBasis>"


def directions(rng, count=200):
    theta_i, theta_r = np.arccos(rng.uniform(0.05, 1.0, (2, count)))
    phi_i, phi_r = rng.uniform(0.0, 2.0 * np.pi, (2, count))
    return theta_i, phi_i, theta_r, phi_r


@pytest.mark.parametrize("rank", [3, 4])
def test_a_tree_of_the_mirror_direction(tmp_path, rank):
    """Bright where the exit's place in the square is that of the direction in which light travels on."""
    size = 8
    grid = np.full((size,) * rank, 0.1)
    middle = (np.arange(size) + 0.5) / size
    for place in np.ndindex(*(size,) * (rank - 2)):
        exit = place if rank == 4 else None
        if rank == 4:
            grid[(*place, *exit)] = 5.0
        elif middle[place[0]] < 0.5:
            grid[place[0], int((1.0 - middle[place[0]]) * size), size // 2 - 1 : size // 2 + 1] = 5.0
    data = "{" + " ".join(map(str, grid.ravel())) + "}"
    path = written(tmp_path, f"TensorTree{rank}", BLOCK.format("Visible", "Reflection Back", TREE, data))
    found = read_radiance(path)
    assert found.channels == ("Y",) and found.isotropic == (rank == 3)
    theta, phi = np.radians([10.0, 25.0, 40.0, 60.0]), np.radians([3.0, 100.0, 200.0, 300.0])
    incident = unit_vectors(theta, phi)
    np.testing.assert_array_equal(found.evaluate(incident, unit_vectors(theta, phi + np.pi)), 5.0)
    np.testing.assert_array_equal(found.evaluate(incident, incident)[1:], 0.1)


@pytest.mark.parametrize("name", LATITUDES)
def test_a_matrix_of_the_mirror_direction(tmp_path, name):
    """An incident patch is numbered by where light goes on, so that the mirror's matrix is diagonal."""
    count = sum(patches for _, patches in LATITUDES[name])
    data = ", ".join(map(str, (0.1 + 5.0 * np.eye(count)).ravel()))
    path = written(tmp_path, "Columns", BLOCK.format("Visible", "Reflection Front", klems(name), data))
    theta_i, phi_i, _, _ = directions(np.random.default_rng(3))
    found = read_radiance(path)
    mirrored = found.evaluate(unit_vectors(theta_i, phi_i), unit_vectors(theta_i, phi_i + np.pi))
    np.testing.assert_allclose(mirrored, 5.1)
    off = theta_i > np.radians(12.0)
    back = found.evaluate(unit_vectors(theta_i, phi_i)[off], unit_vectors(theta_i, phi_i)[off])
    np.testing.assert_allclose(back, 0.1)


def test_colours(tmp_path):
    """u' and v' of the equal-energy white are 4/19 and 9/19: X = Y = Z."""
    trees = (("Visible", 0.2), ("CIE-u", 4 / 19), ("CIE-v", 9 / 19))
    blocks = [BLOCK.format(name, "Reflection Back", TREE, f"{{{value}}}") for name, value in trees]
    found = read_radiance(written(tmp_path, "TensorTree3", *blocks))
    up = np.array([[0.0, 0.0, 1.0]])
    assert found.channels == ("X", "Y", "Z")
    np.testing.assert_allclose(found.evaluate(up, up), 0.2, rtol=1e-12)


@pytest.mark.parametrize(
    ("structure", "block", "said"),
    [
        ("TensorTree3", ("Visible", "Transmission Front", TREE, "{0.1}"), "no reflection"),
        ("TensorTree3", ("Visible", "Reflection Back", TREE, "{0.1 0.2}"), "tensor tree"),
        ("TensorTree3", ("Visible", "Reflection Back", TREE, "{" * 40), "tensor tree"),
        ("TensorTree4", ("Visible", "Reflection Back", TREE, "{a b}"), "tensor tree"),
        ("Columns", ("Visible", "Reflection Back", klems("LBNL/Klems Full"), "0.1 0.2"), "145 by 145"),
        ("Columns", ("Visible", "Reflection Back", klems("Mine"), "0.1"), "unknown angle basis 'Mine'"),
    ],
)
def test_what_cannot_be_read_is_told_in_a_line(tmp_path, structure, block, said):
    with pytest.raises(InputError, match=said) as error:
        read_radiance(written(tmp_path, structure, BLOCK.format(*block)))
    assert "\n" not in str(error.value)


def test_entities_are_refused(tmp_path):
    path = tmp_path / "laughs.xml"
    path.write_text('<!DOCTYPE x [<!ENTITY a "b">]><x>&a;</x>')
    with pytest.raises(InputError, match="entities"):
        read_radiance(path)
