"""The concentric map of disk and square."""

import numpy as np

from photogonio.reconstruct.brdf.shirley_chiu import disk_to_square, square_to_disk


def test_disk_and_square_are_inverse_and_keep_areas():
    a, b = np.random.default_rng(0).uniform(size=(2, 500))
    np.testing.assert_allclose(disk_to_square(*square_to_disk(a, b)), (a, b), atol=1e-12)
    step = 1e-6
    x, y = square_to_disk(a, b)
    dxa, dya = (p - q for p, q in zip(square_to_disk(a + step, b), (x, y), strict=True))
    dxb, dyb = (p - q for p, q in zip(square_to_disk(a, b + step), (x, y), strict=True))
    smooth = (np.abs(a - b) > 1e-3) & (np.abs(a + b - 1) > 1e-3)
    np.testing.assert_allclose(np.abs(dxa * dyb - dxb * dya)[smooth] / step**2, np.pi, rtol=1e-3)


def test_the_middle_is_the_middle_and_the_rim_the_rim():
    np.testing.assert_allclose(square_to_disk(0.5, 0.5), (0.0, 0.0), atol=1e-15)
    along, zero = np.linspace(0.0, 1.0, 33), np.zeros(33)
    for rim in ((along, zero), (along, zero + 1.0), (zero, along), (zero + 1.0, along)):
        np.testing.assert_allclose(np.hypot(*square_to_disk(*rim)), 1.0, rtol=1e-14)


def test_a_quarter_turn_of_one_is_a_quarter_turn_of_the_other():
    a, b = np.random.default_rng(1).uniform(size=(2, 200))
    x, y = square_to_disk(a, b)
    np.testing.assert_allclose(square_to_disk(1.0 - b, a), (-y, x), atol=1e-14)
