"""Klems' patches."""

import numpy as np

from photogonio.reconstruct.brdf.klems import PATCHES, RINGS, patch_of


def test_patches_are_those_of_their_own_rings():
    assert PATCHES == 145
    start = 0
    for low, high, count in RINGS:
        turn = 2 * np.pi * np.arange(count) / count
        assert patch_of(np.full(count, np.radians((low + high) / 2)), turn).tolist() == list(
            range(start, start + count)
        )
        start += count
