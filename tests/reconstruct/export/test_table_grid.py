"""Angles of tables, and words about a BRDF."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.export.table_grid import (
    LAST,
    ROWS,
    STEP,
    Steps,
    polar_nodes,
    scale_in_words,
    title,
    turns,
)
from photogonio.reconstruct.goniometer.merged import MOST
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between_rows, between_turning_rows
from tests.drawn.exports import gloss, matte, over_ground, satin


def test_nodes_are_a_grid_that_readers_know_between_its_rows():
    assert polar_nodes()[0] == 0.0 and polar_nodes()[-1] == LAST
    assert len(turns()) * np.diff(turns())[0] == 360.0
    axes = polar_nodes(), np.zeros(1), polar_nodes(), turns()
    grids = [np.radians(one).ravel() for one in np.meshgrid(*axes, indexing="ij")]
    pairs = unit_vectors(*grids[:2]), unit_vectors(*grids[2:])
    assert between_rows(*pairs, np.ones((len(grids[0]), 1))) is not None
    assert between_turning_rows(*pairs, np.ones((len(grids[0]), 1))) is None  # light from one azimuth


def test_rows_are_dense_about_peaks_alone():
    assert Steps.of(matte(), Steps.half_turn) == Steps(STEP, STEP)
    mirror = Steps.of(over_ground(gloss(0.1)), Steps.half_turn)
    retro = Steps.of(over_ground(gloss(0.1, model="retro")), Steps.half_turn)
    assert mirror.mirror < 4.0 and mirror.retro == STEP
    assert retro.retro < 4.0 and retro.mirror == STEP
    assert len(mirror.polar_nodes()) ** 2 * len(mirror.half_turn()) <= ROWS == MOST
    for steps in (Steps(), mirror, retro):
        half, whole = steps.half_turn(), steps.whole_turn()
        assert half[0] == 0.0 and half[-1] == 180.0 and 0.0 < np.diff(half).min()
        assert np.diff(half).max() <= 30.0  # of a grid that readers know
        np.testing.assert_allclose(np.sort(np.mod(-whole, 360.0)), whole)  # alike on both sides
    assert np.diff(mirror.half_turn()).argmin() > np.diff(retro.half_turn()).argmin()


def test_words():
    assert scale_in_words(satin()) == "absolute scale"
    assert "factor" in scale_in_words(replace(satin(), scale="relative"))
    assert title(satin()) == "photogonio" and title(replace(satin(), source={"name": "oak"})) == "oak"
