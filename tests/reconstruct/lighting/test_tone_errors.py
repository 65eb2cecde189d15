"""What a curve leaves unsure in cells is what is not known of their codes against the paper's, in all photos alike."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.response.curve import BENDS, Curves, prior
from photogonio.calib.setup import Light, PrintTone
from photogonio.capture.photoset import Plane
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lighting.tone_errors import PAPER, by_tone
from tests.reconstruct.lighting.test_sample_place import BELIEVED, seen

CODES = np.linspace(0.0, 1.0, 511)
HEIGHT, WHITE = 300.0, 0.6  # of the lamps; light of the paper, of full scale
COVARIANCE = np.linalg.inv(prior(1).T @ prior(1))  # of what is expected of curves before any print is seen
CURVES = Curves(np.zeros((2, BENDS)), COVARIANCE, (0.05, 0.95))


def setup_and_cells(white=WHITE):
    """A flat sample of one channel, every cell of which lies below the lamp of its view; ``white`` is one number or one
    a view."""
    setup, cells = seen(BELIEVED)
    lamp = Light("lamp", "point", np.array([0.0, 0.0, HEIGHT]), np.zeros((3, 3)), "given")
    strength = np.array([HEIGHT**2 / PAPER])  # so that paper there has a radiance of 1
    views = tuple(replace(v, light=lamp, strength=strength) for v in setup.views)
    whites = np.broadcast_to(white, len(views)).tolist()
    tone = PrintTone(
        table=CURVES.table(511),
        error=np.zeros((511, 1)),
        seen=np.array(CURVES.seen),
        ink=np.array([0.05]),
        misfit=0.001,
        photos=10,
        scale_error=0.03,
        doubts=CURVES.doubts(np.linspace(0.0, 1.0, 103)),
        exposures={view.name: one for view, one in zip(views, whites, strict=True)},
    )
    flat = Plane(np.array([[-30.0, -30.0], [30.0, -30.0], [0.0, 30.0]]))
    cells = replace(cells, place=np.zeros_like(cells.place))
    return replace(setup, views=views, sample=flat, tone=tone), cells


def matte(level: float) -> Model:
    """Lambertian, of ``level`` 1/sr."""
    basis = Basis("isotropic", 0)
    return Model(basis, np.full((1, 1), 2.0 * np.pi * level), LobeSet(), np.zeros((0, 1)))


def errors(setup, cells, level: float) -> np.ndarray:
    """Relative (n,), of all that is unsure."""
    found = by_tone(setup)(cells, matte(level))
    assert matte(level).evaluate(cells) == pytest.approx(level)
    return np.sqrt((found[:, :, 0] ** 2).sum(1)) / level


@pytest.mark.parametrize("share", [0.1, 0.3, 1.5])
def test_a_cell_is_as_unsure_as_its_code_is_against_the_papers(share):
    setup, cells = setup_and_cells()
    codes = np.interp([share * WHITE, WHITE], setup.tone.table[:, 0], CODES)
    expected = CURVES.error_between(codes[:1], codes[1:], 0)
    # some of the ways in which bends err are left out, and between the codes that are kept changes are straight
    assert errors(setup, cells, share * PAPER) == pytest.approx(expected[0], rel=0.03)


def test_what_is_as_bright_as_paper_is_sure():
    setup, cells = setup_and_cells()
    assert errors(setup, cells, PAPER).max() < 1e-9


def test_darker_photos_of_the_same_are_unsure_in_another_way():
    setup, cells = setup_and_cells(np.array([WHITE, 0.2, WHITE, WHITE, WHITE]))
    found = by_tone(setup)(cells, matte(0.3 * PAPER))[:, :, 0]
    first = found[cells.group == 0][0]
    assert np.abs(found[cells.group == 2] - first).max() < 1e-9
    assert np.abs(found[cells.group == 1] - first).max() > 0.1 * np.abs(first).max()


def test_a_lens_that_darkens_and_light_over_the_picture_are_in_the_codes():
    setup, cells = setup_and_cells()
    veil = replace(setup, views=tuple(replace(v, veil=np.full(1, 0.05)) for v in setup.views))
    assert errors(veil, cells, 0.1 * PAPER).max() < errors(setup, cells, 0.1 * PAPER).min()


def test_nothing_is_said_of_curves_that_are_known_or_of_codes_that_are_not():
    setup, _ = setup_and_cells()
    assert by_tone(replace(setup, tone=None)) is None
    assert by_tone(replace(setup, tone=replace(setup.tone, exposures={}))) is None
    assert by_tone(replace(setup, tone=replace(setup.tone, doubts=np.zeros((0, 2, 1))))) is None
