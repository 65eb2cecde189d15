"""The full Klems basis: 145 patches of the hemisphere in nine rings.

Klems, "A new method for predicting the solar heat gain of complex fenestration systems" (ASHRAE Transactions 100,
1994). The first patch of every ring is centred on azimuth 0.
"""

from __future__ import annotations

import numpy as np

# rings: lower and upper polar angle in degrees, number of patches
RINGS = (
    (0, 5, 1),
    (5, 15, 8),
    (15, 25, 16),
    (25, 35, 20),
    (35, 45, 24),
    (45, 55, 24),
    (55, 65, 24),
    (65, 75, 16),
    (75, 90, 12),
)
PATCHES = sum(count for _, _, count in RINGS)


def patch_of(theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """The patch, 0 to 144, that holds each direction; radians."""
    degrees = np.degrees(theta)
    number = np.zeros(np.shape(degrees), int)
    start = 0
    for low, high, count in RINGS:
        within = (degrees >= low) & (degrees <= high)
        turn = np.floor(np.mod(phi, 2 * np.pi) / (2 * np.pi) * count + 0.5).astype(int) % count
        number = np.where(within, start + turn, number)
        start += count
    return number
