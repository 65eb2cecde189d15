"""The whole fit on tables of known surfaces."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.left_out_rows import COLUMNS, fitted_rms, split_of
from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.fit import FitOptions, PhotoErrors, _cells, fit_table
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.lobes.families import CORRELATED_SCHLICK, lobe_columns
from photogonio.reconstruct.modes.angles import pair_angles
from photogonio.reconstruct.represent.bounds import held_pairs
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.reconstruct.uncertainty.in_file import UNTOLD
from photogonio.synthetic.brdf.library import angle_grid, directions, make_brdf, on_grid
from tests.drawn.tables import Plan, simulate
from tests.places import DATA

PTFE = DATA / "nist-ptfe"
PLAN = Plan(views=16, pixels=4000, level=3)
LIMIT = np.radians(70.0)


def relative_error(brdf, truth):
    """The project's relative error below 70 degrees, (c,)."""
    grid = angle_grid()
    grid = grid[(grid[:, 0] < LIMIT) & (grid[:, 1] < LIMIT)]
    true = on_grid(truth, grid)
    found = brdf.evaluate(grid[:, 0], 0.0, grid[:, 1], grid[:, 2])
    weight = (np.sin(2 * grid[:, 0]) * np.sin(2 * grid[:, 1]))[:, None]
    return np.sqrt((weight * (found - true) ** 2).sum(0) / (weight * true**2).sum(0))


def fitted(model, parameters=None, *, options=None, plan=PLAN, seed=1):
    truth = make_brdf(model, parameters)
    return fit_table(simulate(truth, plan, seed=seed), options or FitOptions()), truth


def test_lambert_needs_one_mode_and_no_lobe():
    fit, truth = fitted("lambert", {"albedo": (0.6, 0.4, 0.2)})
    assert fit.brdf.order <= 2 and not fit.brdf.lobes
    assert relative_error(fit.brdf, truth).max() <= 0.01


def test_cells_are_the_same_whatever_parts_a_table_is_looked_at_in(monkeypatch):
    table = simulate(make_brdf("plastic", {"roughness": 0.05}), Plan(views=4, pixels=3000, level=3))
    whole = _cells(table, FitOptions(), PhotoErrors())
    monkeypatch.setattr("photogonio.reconstruct.fit.AT_ONCE", 1 + len(table) // 5)
    parts = _cells(table, FitOptions(), PhotoErrors())
    assert len(whole) > 100 and whole.peaked == parts.peaked
    for name in ("theta_i", "dphi", "value", "variance", "group", "turn"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))


def test_oren_nayar_gets_no_lobe():
    fit, truth = fitted("oren-nayar")
    assert not fit.brdf.lobes
    assert relative_error(fit.brdf, truth).max() <= 0.02


@pytest.mark.parametrize("roughness", [0.2, 0.35])
def test_what_a_pixel_sees_of_a_ball_widens_no_gloss(roughness):
    """Each pixel shows the mean over normals that are turned about both axes, by a fifth of the gloss's own width."""
    variance = (0.2 * roughness) ** 2 / 2.0
    truth = make_brdf("ggx-conductor", {"roughness": roughness})
    table = simulate(over_normals(truth, np.sqrt(variance)), PLAN)
    wide, freed = (
        fit_table(table, known=PhotoErrors(footprint=footprint)).brdf
        for footprint in (None, lambda cells: np.full((len(cells), 2), variance))
    )
    assert wide.lobes[0].axes[0] > 1.02 * roughness  # 0.2^2 in the square of a normal distribution's
    assert freed.lobes[0].axes[0] == pytest.approx(roughness, rel=5e-3)
    assert relative_error(freed, truth).max() < 0.5 * relative_error(wide, truth).max()


def over_normals(brdf, turn):
    """``brdf`` as a pixel shows it whose normals are turned by ``turn`` rms, radians, about each axis."""
    nodes = [(-np.sqrt(3.0), 1 / 6), (0.0, 2 / 3), (np.sqrt(3.0), 1 / 6)]

    def mean(incident, exit):
        total = 0.0
        for (a, first), (b, second) in product(nodes, nodes):
            turned = Rotation.from_rotvec([a * turn, b * turn, 0.0]).as_matrix()
            moved = [one @ turned.T for one in (incident, exit)]
            total = total + first * second * brdf(*(above(one) for one in moved))
        return total

    def above(one):
        one = np.concatenate([one[..., :2], np.maximum(one[..., 2:], 1e-3)], axis=-1)
        return one / np.linalg.norm(one, axis=-1, keepdims=True)

    return mean


@pytest.mark.slow
@pytest.mark.parametrize("roughness", [0.15, pytest.param(0.25, marks=pytest.mark.long), 0.4])
def test_plastic_gets_its_lobe(roughness):
    fit, truth = fitted("plastic", {"roughness": roughness})
    assert len(fit.model.lobes.families) == 1  # the file says it with some of its own, the main one first
    assert fit.brdf.lobes[0].roughness == pytest.approx(roughness, rel=0.03)
    assert relative_error(fit.brdf, truth).max() <= 0.03


def test_metal_is_a_lobe_alone():
    fit, truth = fitted("ggx-conductor", {"roughness": 0.3})
    assert fit.brdf.order <= 2 and len(fit.brdf.lobes) == 1
    assert fit.brdf.lobes[0].roughness == pytest.approx(0.3, rel=0.03)
    assert relative_error(fit.brdf, truth).max() <= 0.03


def test_a_metal_without_tails_is_written_as_it_is_found():
    """Modes that stood for it would ring below zero near grazing."""
    table = simulate(make_brdf("lambert"), Plan(views=14, pixels=1500, level=2, spoiled=0.0))
    theta_i, theta_r, dphi = pair_angles(table.incident, table.exit)
    lobe = LobeSet((CORRELATED_SCHLICK.with_beckmann,), (np.array([0.2]),))
    silver = Model(Basis("isotropic", 0), np.zeros((1, 3)), lobe, np.full((1, 3), 0.95))
    value = silver.evaluate(Cells.of_angles(theta_i, theta_r, np.abs(dphi)))
    value *= 1 + 0.003 * np.random.default_rng(0).normal(size=value.shape)
    found = fit_table(
        replace(table, value=value * table.weight[:, None]), FitOptions(symmetry="isotropic", lobes=1)
    )
    (one,) = found.brdf.lobes
    assert (one.model, one.distribution) == ("mirror", "beckmann")
    assert one.roughness == pytest.approx(0.2, rel=0.01)
    pairs = held_pairs()
    assert_same(found, pairs)
    assert found.diagnostics["physics"] == {"held": False}


def test_what_is_asked_is_obeyed():
    fit, _ = fitted(
        "oren-nayar", options=FitOptions(order=5, lobes=1), plan=replace(PLAN, pixels=1200, level=2)
    )
    assert fit.brdf.order == 5 and len(fit.brdf.lobes) == 1


def test_the_same_table_gives_the_same_numbers():
    table = simulate(make_brdf("oren-nayar"), replace(PLAN, views=8, pixels=1200, level=2))
    first, second = (fit_table(table, FitOptions(lobes=0)).brdf for _ in range(2))
    np.testing.assert_array_equal(first.coefficients, second.coefficients)
    np.testing.assert_array_equal(first.standard_errors, second.standard_errors)


def ptfe(wavelength):
    if not PTFE.exists():
        pytest.skip("the PTFE measurements are not at hand")
    where = [("lambda", wavelength)]
    return samples_table(read_samples(PTFE / "PTFE.data.csv", columns=COLUMNS, where=where))


def relative_rms(brdf, cells):
    found = brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    return float(np.sqrt(np.mean((found / cells.value - 1.0) ** 2)))


@pytest.mark.parametrize(
    ("wavelength", "goal"), [("0.532", 0.0097), ("0.351", 0.0110), ("0.633", 0.0110), ("1.064", 0.0178)]
)
def test_ptfe_is_fitted_as_well_as_its_makers_did(wavelength, goal):
    table = ptfe(wavelength)
    assert relative_rms(fit_table(table).brdf, cells_of(table)) <= goal


@pytest.mark.slow
@pytest.mark.parametrize("wavelength", ["0.532", pytest.param("1.064", marks=pytest.mark.long)])
def test_any_order_predicts_rows_left_out(wavelength):
    split = split_of(ptfe(wavelength), seed=1)
    _, auto = fitted_rms(split)
    for order in (8, 10, 12, 16):
        assert fitted_rms(split, order)[1] <= 1.1 * auto


def test_a_high_order_does_not_swing_between_the_angles_that_were_measured():
    table = ptfe("0.532")
    low, high = (fit_table(table, FitOptions(order=order, lobes=0)).brdf for order in (6, 12))
    theta_i, theta_r = np.radians([7.5, 22.5, 37.5, 52.5, 67.5]), np.radians(np.arange(5.0, 71.0, 10.0))
    i, r, d = np.meshgrid(theta_i, theta_r, np.radians(np.arange(10.0, 180.0, 20.0)), indexing="ij")
    ratio = high.evaluate(i, 0.0, r, d) / low.evaluate(i, 0.0, r, d)
    assert np.abs(ratio - 1.0).max() <= 0.03


def test_published_coefficients_lie_within_the_standard_errors():
    table = ptfe("0.532")
    brdf = fit_table(table, FitOptions(order=7, lobes=0)).brdf
    rows = np.loadtxt(PTFE / "PTFE.532.coeff.csv", delimiter=",")
    published = {tuple(row[2:5].astype(int)): row[7] for row in rows if row[0] == row[1] == 1}
    z = [
        (coefficient - published[tuple(mode)]) / error
        for mode, coefficient, error in zip(
            brdf.modes.tolist(), brdf.coefficients[:, 0], brdf.standard_errors[:, 0], strict=True
        )
        if tuple(mode) in published
    ]
    assert len(z) >= 30
    assert np.mean(np.abs(z) < 2.0) >= 0.9


def goniometer_rows(truth):
    """What a goniometer reads of a surface in steps of ten degrees, with noise of 1 %."""
    step = np.radians(10.0)
    theta_i, theta_r, phi_r = (
        angle.ravel()
        for angle in np.meshgrid(
            step / 2 + step * np.arange(8), step * np.arange(9), 1.5 * step * np.arange(13)
        )
    )
    true = truth(directions(theta_i, np.zeros_like(phi_r)), directions(theta_r, phi_r))
    noisy = true * (1.0 + 0.01 * np.random.default_rng(0).normal(size=true.shape))
    rows = GoniometerSamples(theta_i, np.zeros_like(phi_r), theta_r, phi_r, noisy, None, ("Y",))
    return samples_table(rows)


def test_a_goniometer_s_gloss_about_the_mirror_direction_is_one_peak_said_in_modes():
    """A cosine to the power of 20; noise of 1 % on each of 936 rows leaves much less of a few unknowns."""
    phong = make_brdf("phong", {"power": 20.0})

    def truth(incident, exit):
        return phong(incident, exit)[:, :1]

    found = fit_table(goniometer_rows(truth))
    assert [family.about == "mirror" for family in found.model.lobes.families] == [True]
    assert found.brdf.lobes == () and found.brdf.order > found.model.basis.order
    assert relative_error(found.brdf, truth).max() <= 0.01


def test_a_goniometer_s_gloss_that_is_no_lobe_of_ours_gets_the_modes_it_needs():
    """Flat to 20 degrees about the mirror direction, and steep beyond."""

    def truth(incident, exit):
        cosine = ((incident * [-1.0, -1.0, 1.0]) * exit).sum(-1)
        apart = np.arccos(np.clip(cosine, -1.0, 1.0))
        return (0.05 + np.exp(-((apart / 0.4) ** 6)))[:, None]

    table = goniometer_rows(truth)
    auto, twelve = (fit_table(table, FitOptions(order=order)).brdf for order in (None, 12))
    assert auto.order > 12
    assert (relative_error(auto, truth) < 0.8 * relative_error(twelve, truth)).all()


def test_cells_without_a_number_are_refused_in_words():
    table = simulate(make_brdf("lambert"), replace(PLAN, views=4, pixels=300, level=2))
    with pytest.raises(InputError, match="no cell"):
        fit_table(replace(table, value=np.full_like(table.value, np.nan)))


def rows_of(value, theta_i, theta_r, phi_r):
    return samples_table(
        GoniometerSamples(
            theta_i, np.zeros_like(theta_i), theta_r, phi_r, value, None, ("R", "G")[: value.shape[1]]
        )
    )


def test_a_channel_that_is_0_everywhere_is_refused_in_words():
    angle = np.linspace(0.1, 1.0, 50)
    value = np.column_stack([np.full(50, 0.2), np.zeros(50)])
    with pytest.raises(InputError, match=r"channel G.*0 in every cell"):
        fit_table(rows_of(value, angle, angle, angle))


def test_a_narrow_peak_among_zeros_is_fitted():
    """Readings to two places: beside the peak most are 0, and say no more than that f is below 0.01."""
    rng = np.random.default_rng(0)
    theta_i, theta_r = np.radians(rng.uniform(0.0, 70.0, (2, 600)))
    phi_r = np.pi - np.minimum(np.abs(rng.normal(size=600)), np.pi)
    metal, shape = CORRELATED_SCHLICK.with_beckmann, np.array([0.05])
    fixed, column = lobe_columns(metal, shape, theta_i, theta_r, phi_r)
    value = np.round(fixed[:, None] + 0.8 * column, 2)
    assert np.median(value) == 0.0
    found = fit_table(rows_of(value, theta_i, theta_r, phi_r))
    np.testing.assert_allclose(found.model.lobes.shapes[0], shape, rtol=0.02)
    # of a metal of base reflectance 0.8, whose least albedo is that
    assert 0.78 < found.brdf.bihemispherical_albedo()[0] < 0.84


def test_a_model_is_evaluated_the_same_by_fit_and_file():
    fit, _ = fitted("ggx-conductor", plan=replace(PLAN, pixels=1200, level=2))
    rng = np.random.default_rng(0)
    cells = Cells.of_angles(*np.arccos(rng.uniform(0.35, 1.0, (2, 500))), rng.uniform(0, np.pi, 500))
    assert_same(fit, cells)


def assert_same(fit, cells):
    """Of file and fit, but for digits that mean nothing beside the error."""
    file = fit.brdf.evaluate(cells.theta_i, 0.0, cells.theta_r, cells.dphi)
    assert (np.abs(file - fit.model.evaluate(cells)) <= 2.0 * UNTOLD * fit.standard_error(cells)).all()
