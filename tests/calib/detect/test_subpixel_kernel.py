"""The print laid over a window: the shift of a drawn corner comes back, whatever its light."""

import numpy as np
import pytest
from scipy.special import erf

from photogonio.calib.detect.subpixel_kernel import find_shifts

HALF, SCALE, SIDE = (
    9,
    8.0,
    40,
)  # pixels of the window, drawing's pixels a length, window's reach: 1 length = 1 pixel
MIDDLE = 24
TURN = 0.35
COSINE, SINE = np.cos(TURN), np.sin(TURN)


def tone() -> np.ndarray:
    """Four squares that meet in the middle of 40 x 40 lengths, y up."""
    size = round(SCALE * SIDE)
    white = np.zeros((size, size), np.float32)
    white[: size // 2, size // 2 :] = white[size // 2 :, : size // 2] = 1.0
    return white


def photo(shift: tuple[float, float], *, blur: float = 0.25 + 1 / 12) -> np.ndarray:
    """The same as a camera rolled by TURN sees it, moved by ``shift`` pixels: blurred steps are error functions.

    Along an edge all parts of a pixel are met, as they are in photos.
    """
    step = np.arange(2 * MIDDLE + 1) - MIDDLE
    u, v = step[None, :] - shift[0], step[:, None] - shift[1]
    root = 1 / np.sqrt(2 * blur)
    across, up = COSINE * u + SINE * v, SINE * u - COSINE * v
    return 0.5 + 0.5 * erf(root * up) * erf(root * across)  # white at the upper right


def found(level: np.ndarray, *, clear: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """Shift and its error; the board's y is up, the picture's down."""
    flat = np.zeros((1, 2, 6))
    flat[0, 0, :3] = SIDE / 2, HALF * COSINE, HALF * SINE
    flat[0, 1, :3] = SIDE / 2, HALF * SINE, -HALF * COSINE
    shift, sigma, drawing = np.empty((1, 2)), np.empty(1), tone()
    bare = clear is not None
    clear = np.ones(drawing.shape, bool) if clear is None else clear
    middle, half = np.array([[MIDDLE, MIDDLE]]), np.array([HALF])
    find_shifts(drawing, clear, bare, SCALE, flat, level[None].astype(np.float32), middle, half, shift, sigma)
    return shift[0], float(sigma[0])


@pytest.mark.parametrize("shift", [(0.0, 0.0), (0.31, -0.22), (-0.7, 0.45), (0.9, 0.6)])
def test_a_shift_comes_back(shift):
    """The camera's box of a pixel is taken as a normal distribution here: that is off by hundredths."""
    place, sigma = found(photo(shift))
    np.testing.assert_allclose(place, shift, atol=0.02)
    assert sigma < 0.02


@pytest.mark.parametrize("blur", [0.15, 0.35, 0.6])
def test_light_and_blur_do_not_move_it(blur):
    """Brighter, on a pedestal, with light that grows across the window, sharper or less sharp than is drawn."""
    level, step = photo((0.2, -0.3), blur=blur), (np.arange(2 * MIDDLE + 1) - MIDDLE) / HALF
    lit = (3.0 + 0.3 * step) * level + 0.2 + 0.1 * step[:, None]
    place, sigma = found(lit)
    np.testing.assert_allclose(place, [0.2, -0.3], atol=0.04)
    assert np.isfinite(sigma)


def test_the_stated_error_is_that_of_noise():
    rng, true = np.random.default_rng(2), np.array([0.25, 0.1])
    trials = [found(photo(tuple(true)) + 0.05 * rng.normal(size=(2 * MIDDLE + 1,) * 2)) for _ in range(60)]
    off = np.array([place - true for place, _ in trials])
    stated = np.median([sigma for _, sigma in trials])
    # 120 numbers tell a deviation to 6 %; 1.5 times as much is stated, for pixels that blur ties together in photos
    assert off.std() < stated < 2.2 * off.std()


def test_a_little_that_hides_the_print_is_left_out():
    level = photo((0.2, -0.3))
    level[MIDDLE - 8 : MIDDLE - 3, MIDDLE + 3 : MIDDLE + 8] = 0.4
    place, sigma = found(level)
    np.testing.assert_allclose(place, [0.2, -0.3], atol=0.04)
    assert np.isfinite(sigma)


@pytest.mark.parametrize("case", ["negative", "noise", "far", "half missing", "blank"])
def test_what_does_not_agree_is_not_placed(case):
    level = photo((0.0, 0.0))
    if case == "negative":
        level = 1.0 - level
    if case == "noise":
        level = np.random.default_rng(3).uniform(size=level.shape)
    if case == "far":
        level = photo((2.0, 0.0))
    if case == "half missing":
        level[:, : MIDDLE - 1] = np.nan
    if case == "blank":
        level[:] = 0.5
    assert np.isinf(found(level)[1])


def test_where_only_part_of_the_drawing_counts_the_rest_may_be_anything():
    """Markers' places, if they are not to be trusted: a quarter of the window."""
    clear = np.ones((round(SCALE * SIDE),) * 2, bool)
    clear[: round(SCALE * SIDE) // 2, round(SCALE * (SIDE / 2 + 3)) :] = (
        False  # the upper right, 3 pixels aside
    )
    level = photo((0.3, 0.2))
    level[: MIDDLE - 1, MIDDLE + 5 :] = np.random.default_rng(4).uniform(size=(MIDDLE - 1, MIDDLE - 4))
    place, _ = found(level, clear=clear)
    np.testing.assert_allclose(place, [0.3, 0.2], atol=0.03)
