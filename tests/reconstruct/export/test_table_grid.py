"""Angles of tables, and words about a BRDF."""

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.export import table_grid
from photogonio.reconstruct.export.loss import ANGLES, loss_of
from photogonio.reconstruct.export.table_grid import (
    LAST,
    LAST_EXIT,
    STEP,
    TURN,
    TableNodes,
    TableValues,
    scale_in_words,
    title,
)
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.gridded import between
from tests.drawn.exports import gloss, matte, over_ground, satin


def test_nodes_are_dense_about_peaks_and_toward_grazing_alone():
    plain, peaked = TableNodes.of(matte()), TableNodes.of(over_ground(gloss(0.1)))
    retro = TableNodes.of(over_ground(gloss(0.1, model="retro")))
    for nodes in (plain, peaked, retro):
        assert nodes.theta_i[0] == nodes.theta_r[0] == 0.0 == nodes.dphi[0] and nodes.dphi[-1] == 180.0
        assert nodes.theta_i[-1] == LAST and nodes.theta_r[-1] == LAST_EXIT
        assert max(np.diff(nodes.theta_i).max(), np.diff(nodes.theta_r).max()) < STEP + 0.01
        assert 0.0 < np.diff(nodes.dphi).min() and np.diff(nodes.dphi).max() < TURN + 0.01
    assert plain.rows < 6000 and np.ptp(np.diff(plain.dphi)) < 0.01
    assert np.diff(peaked.theta_i)[-1] < 0.7 * np.diff(peaked.theta_i)[0] < 0.5 * STEP
    # half a roughness of the half vector is an azimuth of a roughness times the cosine, when it is small
    first = np.diff(peaked.dphi)[-1]
    assert first < np.degrees(0.1 * np.cos(np.radians(LAST))) < 10.0 * first
    assert np.diff(peaked.dphi).argmin() > len(peaked.dphi) // 2 > np.diff(retro.dphi).argmin()


def test_lines_between_rows_add_no_light_even_of_few_rows(monkeypatch):
    monkeypatch.setattr(table_grid, "ROWS", {False: 60_000, True: 120_000})
    for brdf in (over_ground(gloss(0.1)), over_ground(gloss((0.5, 0.3), azimuth=0.4))):
        table = TableValues.of(brdf)
        nodes = table.nodes
        assert nodes.rows <= table_grid.ROWS[brdf.turning]
        theta_i, phi_i, theta_r, phi_r = np.radians(nodes.angles())
        rows = unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r)
        plain = brdf(*rows)
        assert (table.value.reshape(plain.shape) <= plain * (1.0 + 1e-9)).all()
        read = between(*rows, table.value.reshape(plain.shape))
        assert read is not None and table.factor.max() <= 1.0
        assert max(loss_of(brdf, read).albedo) < 1.005, ANGLES


def test_words():
    assert scale_in_words(satin()) == "absolute scale"
    assert "factor" in scale_in_words(replace(satin(), scale="relative"))
    assert title(satin()) == "photogonio" and title(replace(satin(), source={"name": "oak"})) == "oak"
