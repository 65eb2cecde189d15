"""Whether rows resolve the peak that a fit has between them."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import retro_lobe, round_lobe
from photogonio.reconstruct.rows.resolved import CORE, core_unseen, resolved_by
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table

WIDTH = 0.03  # of the peak


def model(order: int = 0, wave: float = 0.0, weight: float = 0.3) -> Model:
    """A round lobe on a dim matte, with the last mode up to ``order``."""
    basis = Basis("isotropic", order)
    coefficients = np.zeros((len(basis.modes), 1))
    coefficients[0] = 0.02
    coefficients[-1] += wave
    return Model(
        basis,
        coefficients,
        LobeSet((round_lobe(absolute=True),), (np.array([WIDTH]),)),
        np.array([[weight]]),
    )


def scan(step: float, of: Model) -> Cells:
    """The plane of incidence in steps (degrees)."""
    incident, slant = np.meshgrid(
        [10.0, 30.0, 50.0], np.arange(-80.0 + 0.5 * step, 80.0, step), indexing="ij"
    )
    theta_i, theta_r = np.radians(incident.ravel()), np.radians(np.abs(slant.ravel()))
    phi = np.where(slant.ravel() > 0.0, np.pi, 0.0)
    where = Cells.of_directions(theta_i, 0.0 * theta_i, theta_r, phi)
    value = of.evaluate(where)
    return cells_of(
        samples_table(GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, phi, value, None, ("Y",)))
    )


@pytest.mark.parametrize(("step", "unresolved"), [(20.0, True), (1.0, False)])
def test_a_peak_is_resolved_where_its_flank_was_read(step, unresolved):
    """Steps of 20 degrees from the mirror direction hold the top of a lobe of some degrees, and nothing else."""
    assert resolved_by(scan(step, model()), model()).unresolved == unresolved


def test_what_modes_of_high_order_mend_is_known_at_the_rows_alone():
    plain, mended = model(), model(12, 0.1)
    assert resolved_by(scan(1.0, plain), plain).mended == 0.0
    assert resolved_by(scan(1.0, mended), mended).unresolved


def test_a_surface_without_a_peak_is_resolved_by_few_rows():
    matte = model(weight=1e-6)
    found = resolved_by(scan(20.0, matte), matte)
    assert found.apart < 0.1 and found.rings is None and not found.unresolved


@pytest.mark.parametrize(
    ("nearest", "weight", "unseen"), [(22.5, 3.0, True), (1.0, 3.0, False), (22.5, 0.02, False)]
)
def test_a_peak_is_told_only_by_rows_as_near_to_its_direction_as_it_is_wide(nearest, weight, unseen):
    """A lobe that falls to a tenth within 25 degrees, with nothing read nearer than its foot; and one too weak to
    matter."""
    basis = Basis("isotropic", 0)
    lobes = LobeSet((retro_lobe(absolute=True),), (np.array([0.15]),))
    surface = Model(basis, np.array([[0.1]]), lobes, np.array([[weight]]))
    slant = np.radians([0.0, 15.0, 30.0, 45.0])
    away = np.radians(nearest * np.arange(1, 4))
    theta_i, apart = (one.ravel() for one in np.meshgrid(slant, away))
    exit = theta_i - apart
    rows = Cells.of_angles(theta_i, np.abs(exit), np.where(exit < 0.0, np.pi, 0.0))
    assert (core_unseen(rows, surface) > CORE) == unseen
