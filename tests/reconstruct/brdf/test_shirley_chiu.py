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
