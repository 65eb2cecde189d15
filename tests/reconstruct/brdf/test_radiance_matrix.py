"""Matrices of a BSDF XML: which patch holds a direction, and which way a block is laid out."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest

from photogonio.reconstruct.brdf.radiance_matrix import KLEMS, LATITUDES, AngleBasis, angle_bases, matrix_of
from photogonio.reconstruct.modes.angles import unit_vectors

OWN = """<Layer><AngleBasis><AngleBasisName>Two rings</AngleBasisName>
<AngleBasisBlock><nPhis>1</nPhis><ThetaBounds><LowerTheta>0</LowerTheta></ThetaBounds></AngleBasisBlock>
<AngleBasisBlock><nPhis>2</nPhis><ThetaBounds><LowerTheta>45</LowerTheta></ThetaBounds></AngleBasisBlock>
</AngleBasis></Layer>"""
BASES = angle_bases(ElementTree.fromstring(OWN))


def block(data: str, name: str = "Two rings") -> ElementTree.Element:
    return ElementTree.fromstring(
        f"<B><ColumnAngleBasis>{name}</ColumnAngleBasis><RowAngleBasis>{name}</RowAngleBasis>"
        f"<ScatteringData>{data}</ScatteringData></B>"
    )


@pytest.mark.parametrize("name", LATITUDES)
def test_the_middles_of_patches_are_numbered_in_their_order(name):
    rings = LATITUDES[name]
    edges = [low for low, _ in rings] + [90.0]
    theta, phi = [], []
    for (low, count), high in zip(rings, edges[1:], strict=True):
        theta += [0.5 * (low + high)] * count
        phi += (360.0 * np.arange(count) / count).tolist()
    basis = AngleBasis.of(rings)
    found = basis.index(unit_vectors(np.radians(theta), np.radians(phi)))
    np.testing.assert_array_equal(found, np.arange(len(basis)))


def test_the_full_basis_is_klems():
    assert sum(count for _, _, count in KLEMS) == len(AngleBasis.of(LATITUDES["LBNL/Klems Full"])) == 145
    assert [high for _, high, _ in KLEMS] == [low for low, _, _ in KLEMS[1:]] + [90]


def test_a_direction_is_in_the_patch_whose_bounds_hold_it():
    basis = AngleBasis.of(LATITUDES["LBNL/Klems Half"])
    rng = np.random.default_rng(0)
    theta, phi = np.arccos(rng.uniform(0.0, 1.0, 2000)), rng.uniform(-np.pi, np.pi, 2000)
    number = basis.index(unit_vectors(theta, phi))
    first = np.concatenate([[0], np.cumsum(basis.patches)])
    ring = np.searchsorted(first, number, side="right") - 1
    upper = np.append(basis.lower[1:], np.pi / 2)
    assert ((basis.lower[ring] <= theta) & (theta <= upper[ring])).all()
    middle = 2.0 * np.pi * (number - first[ring]) / basis.patches[ring]
    off = np.abs((phi - middle + np.pi) % (2.0 * np.pi) - np.pi)
    assert (off <= np.pi / basis.patches[ring] + 1e-12).all()


def test_rows_are_columns_the_other_way_round():
    columns = matrix_of(block("1 2 3 4 5 6 7 8 9"), "Columns", BASES)
    rows = matrix_of(block("1, 4, 7, 2, 5, 8, 3, 6, 9"), "Rows", BASES)
    np.testing.assert_array_equal(rows.value, columns.value)
    # light from azimuth 180 travels on toward 0: the first patch of the ring; it leaves toward the pole
    side, up = unit_vectors(np.array([1.2]), np.array([np.pi])), unit_vectors(np.zeros(1), np.zeros(1))
    assert columns(side, up)[0, 0] == 2.0
    assert columns(up, -side * [1.0, 1.0, -1.0])[0, 0] == 4.0
    assert columns(-side, up)[0, 0] == 0.0


@pytest.mark.parametrize(
    ("data", "name", "said"),
    [
        ("1 2 3", "Two rings", "3 values for 3 by 3 patches"),
        ("1 2 3 4 5 6 7 8 inf", "Two rings", "not finite"),
        ("1", "None such", "unknown angle basis 'None such'"),
    ],
)
def test_what_cannot_be_used_says_why(data, name, said):
    with pytest.raises(ValueError, match=said):
        matrix_of(block(data, name), "Columns", BASES)
