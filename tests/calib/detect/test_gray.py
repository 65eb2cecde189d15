"""Pictures fit for detection: the same light, whatever its scale, and pieces as of the whole."""

import numpy as np
import pytest

from photogonio.calib.detect.gray import (
    detection_image,
    fine_about,
    fine_image,
    finite,
    gray,
    halved,
    without_fireflies,
)
from tests.drawn.boards import radiance

RNG = np.random.default_rng(0)


@pytest.fixture(scope="module")
def level() -> np.ndarray:
    y, x = np.mgrid[0:90, 0:120]
    ground = 0.05 + 0.4 * (x + y) / 210 + 0.1 * np.sin(x / 7) * np.sin(y / 5)
    return (ground + 0.002 * RNG.normal(size=ground.shape)).astype(np.float32)


def test_gray_is_the_mean_of_the_channels_and_knows_what_is_finite(level):
    image = radiance(level, 0.0, 3)
    image.value[..., 1] *= 2
    np.testing.assert_allclose(gray(image), level * 4 / 3, rtol=1e-6)
    image.value[3, 4, 2] = np.nan
    assert gray(image)[3, 4] == 0 and np.argwhere(~finite(image)).tolist() == [[3, 4]]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_what_is_searched_does_not_hang_on_the_exposure(level, scale):
    """Whole numbers are cut off: rounding may take one of them to the next."""
    apart = detection_image(level * np.float32(scale)).astype(int) - detection_image(level)
    assert np.abs(apart).max() <= 1 and (apart != 0).mean() < 1e-3
    np.testing.assert_allclose(fine_image(level * np.float32(scale)), fine_image(level), rtol=1e-5)


def test_bright_things_do_not_darken_the_board(level):
    """One pixel in a hundred is a thousand times as bright: neither percentile sees so few."""
    lit = level.copy()
    lit.ravel()[::300] = 500.0
    here = lit < 1
    assert np.abs(detection_image(lit).astype(int) - detection_image(level))[here].max() <= 3
    assert fine_image(lit).max() == 1.0 and not detection_image(np.zeros((9, 9))).any()


def test_fireflies_go_and_all_else_stays(level):
    lit = level.copy()
    places = [(5, 5), (40, 77), (89, 0)]
    for y, x in places:
        lit[y, x] = 30.0
    calm = without_fireflies(lit)
    mask = np.zeros(level.shape, bool)
    mask[tuple(np.transpose(places))] = True
    np.testing.assert_array_equal(calm[~mask], level[~mask])
    assert np.abs(calm[mask] - level[mask]).max() < 0.05
    np.testing.assert_array_equal(without_fireflies(level), level)


@pytest.mark.parametrize("shape", [(8, 10), (9, 10), (8, 11)])
def test_half_the_size_keeps_the_mean(shape):
    level = RNG.uniform(size=shape).astype(np.float32)
    found = halved(level)
    assert found.shape == (shape[0] // 2, shape[1] // 2)
    even = level[: shape[0] // 2 * 2, : shape[1] // 2 * 2]
    assert found.mean() == pytest.approx(even.mean(), rel=1e-6)


def test_pieces_about_places_are_those_of_the_whole_picture(level):
    """Each shows the picture where it says, but for its rim, whose pixels have other neighbours."""
    places, reach = np.array([[30.2, 41.7], [60.0, 20.4], [100.9, 70.1]]), 6
    pieces, offset = fine_about(level, places, reach)
    whole, side = fine_image(level), 2 * reach + 1
    assert pieces.shape == (3 * side, side) and offset.shape == (3, 2)
    for k, place in enumerate(places):
        rows, columns = np.arange(k * side + 1, (k + 1) * side - 1), np.arange(1, side - 1)
        there = whole[np.ix_(rows + offset[k, 1], columns + offset[k, 0])]
        np.testing.assert_array_equal(pieces[np.ix_(rows, columns)], there)
        middle = offset[k] + [reach, k * side + reach]
        assert np.abs(middle - place).max() <= 0.5
