"""What people give to a BRDF of any kind: the same answer, or one clear line."""

from __future__ import annotations

import numpy as np
import pytest

import photogonio as pg
from photogonio.capture.errors import InputError
from photogonio.face.known import KnownBrdf
from photogonio.face.measured import MeasuredBrdf
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.lobes.lobe import Lobe

UP, SIDE = np.array([0.0, 0.0, 1.0]), np.array([0.6, 0.0, 0.8])
KINDS = ("coefficients", "merl", "csv")
ONE_LINE = r"\A[^\n]+\Z"


def measured() -> MeasuredBrdf:
    one = np.ones(3)
    brdf = Brdf(
        order=0,
        channels=("R", "G", "B"),
        modes=np.zeros((1, 3), int),
        coefficients=np.array([[0.5, 0.4, 0.3]]),
        standard_errors=np.full((1, 3), 0.01),
        lobes=(Lobe(0.3, 0.05 * one, one),),
    )
    return MeasuredBrdf.of(brdf)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The same BRDF, each kind of file of it."""
    folder = tmp_path_factory.mktemp("files")
    brdf = measured()
    brdf.save(folder / "coefficients.json")
    brdf.export("merl", folder / "table.binary")
    brdf.export("csv", folder / "rows.csv")
    names = ("coefficients.json", "table.binary", "rows.csv")
    return {kind: pg.load(folder / name) for kind, name in zip(KINDS, names, strict=True)}


@pytest.fixture(params=KINDS[:2])
def brdf(request, files):
    return files[request.param]


@pytest.mark.parametrize("wrong", [np.nan * UP, 0.0 * UP, np.array([np.inf, 0.0, 1.0])])
def test_what_is_no_direction_has_no_value(brdf, wrong):
    pair = np.stack([wrong, SIDE])
    for found in (brdf(pair, SIDE), brdf(SIDE, pair)):
        assert np.isnan(found[0]).all() and (found[1] > 0.0).all()


def test_a_vectors_length_means_nothing(brdf):
    for long, short in ((3.0, 0.2), (1e200, 1e-200), (1e307, 1.0), (1e100, 1e160)):
        np.testing.assert_allclose(brdf(long * SIDE, short * UP), brdf(SIDE, UP), rtol=1e-12)
        np.testing.assert_allclose(brdf(short * UP, long * SIDE), brdf(UP, SIDE), rtol=1e-12)


def test_angles_that_are_no_number_have_no_value_and_no_albedo(brdf):
    assert np.isnan(brdf.angles(np.array([np.nan, 0.1]), 0.1, 0.2)[0]).all()
    albedo = brdf.directional_albedo(np.array([np.nan, 0.3, 2.0]))
    assert np.isnan(albedo[0]).all() and (albedo[1] > 0.0).all() and (albedo[2] == 0.0).all()


def test_a_negative_angle_is_on_the_other_side_of_the_normal(brdf):
    np.testing.assert_allclose(brdf.angles(-0.3, 0.2, 0.5), brdf.angles(0.3, 0.2, 0.5 - np.pi), rtol=1e-12)
    np.testing.assert_allclose(brdf.directional_albedo(-0.3), brdf.directional_albedo(0.3), rtol=1e-9)


@pytest.mark.parametrize(
    ("job", "named"),
    [
        (lambda b: b(np.ones(2), SIDE), "incident"),
        (lambda b: b(SIDE, 1.0), "exit"),
        (lambda b: b(SIDE, "up"), "exit"),
        (lambda b: b(np.ones((4, 3)), np.ones((5, 3))), "incident and exit"),
        (lambda b: b.angles(np.ones(3), np.ones(4), 0.0), "theta_i and theta_r"),
        (lambda b: b.standard_error(np.ones((4, 3)), np.ones((5, 3))), "incident and exit"),
        (lambda b: b.standard_error(0.1, "a", 0.2), "theta_r"),
        (lambda b: b.compare(b, mask="wide"), "mask"),
        (lambda b: b.compare(b, mask=-1.0), "mask"),
        (lambda b: b.compare(b, mask=np.nan), "mask"),
        (lambda b: b.compare(3), "compare"),
        (
            lambda b: b.export("mitsuba", "no-such-folder/one.bsdf"),
            "no-such-folder/one.bsdf: there is no folder",
        ),
        (lambda b: b.export("nothing", "one"), "--format nothing"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(brdf, job, named):
    with pytest.raises(InputError, match=ONE_LINE) as error:
        job(brdf)
    assert str(error.value).startswith(named)


def test_what_has_no_coefficients_has_the_same_methods_and_says_so(files, tmp_path):
    known, own = files["merl"], files["coefficients"]
    assert isinstance(known, KnownBrdf)
    methods = [name for name in dir(own) if not name.startswith("_")]
    fields = set(Brdf.__dataclass_fields__) | {"prediction_interval", "of", "bihemispherical_albedo"}
    assert not [name for name in methods if name not in fields and not hasattr(known, name)]
    assert np.isnan(known.standard_error(SIDE, UP)).all() and known.standard_error(SIDE, UP).shape == (3,)
    for job in (lambda: known.sample(2), lambda: known.save(tmp_path / "a.json")):
        with pytest.raises(InputError, match=ONE_LINE):
            job()


@pytest.mark.parametrize("count", [-1, 1.5, "two", True])
def test_no_number_of_draws(files, count):
    with pytest.raises(InputError, match=ONE_LINE):
        files["coefficients"].sample(count)


@pytest.mark.parametrize("order", [-1, "a", 1.5])
def test_no_order(files, order, tmp_path):
    with pytest.raises(InputError, match=ONE_LINE):
        files["coefficients"].export("modes", tmp_path / "a.json", order=order)
    assert not list(tmp_path.iterdir())


def test_rows_of_an_isotropic_brdf_are_not_said_to_turn(files):
    rows = files["csv"]
    assert not rows.turning and repr(rows).splitlines()[1].startswith("isotropic")


def test_an_exported_file_says_its_loss_itself(files, tmp_path):
    said = files["coefficients"].export("openpbr", tmp_path / "a.mtlx")
    assert said in (tmp_path / "a.mtlx").read_text()


def test_a_folder_that_holds_nothing_is_told_by_what_is_looked_for(tmp_path):
    with pytest.raises(InputError, match=r"coefficients\.json") as error:
        pg.load(tmp_path)
    assert "pab-opto" not in str(error.value)


def test_complex_numbers_are_refused_and_not_cut_to_their_real_part():
    with pytest.raises(InputError, match="incident: numbers are needed"):
        measured()(SIDE + 0.1j, UP)
