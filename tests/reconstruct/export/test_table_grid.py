"""Angles of tables, and words about a BRDF."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.export.table_grid import LAST, polar_nodes, scale_in_words, title, turns
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between_rows, between_turning_rows
from tests.drawn.exports import satin


def test_nodes_are_a_grid_that_readers_know_between_its_rows():
    assert polar_nodes()[0] == 0.0 and polar_nodes()[-1] == LAST
    assert len(turns()) * np.diff(turns())[0] == 360.0
    axes = polar_nodes(), np.zeros(1), polar_nodes(), turns()
    grids = [np.radians(one).ravel() for one in np.meshgrid(*axes, indexing="ij")]
    pairs = unit_vectors(*grids[:2]), unit_vectors(*grids[2:])
    assert between_rows(*pairs, np.ones((len(grids[0]), 1))) is not None
    assert between_turning_rows(*pairs, np.ones((len(grids[0]), 1))) is None  # light from one azimuth


def test_words():
    assert scale_in_words(satin()) == "absolute scale"
    assert "factor" in scale_in_words(replace(satin(), scale="relative"))
    assert title(satin()) == "photogonio" and title(replace(satin(), source={"name": "oak"})) == "oak"
