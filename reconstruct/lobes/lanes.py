"""Many pairs of directions side by side, as compiled sums of lobes take them.

Sines of the half vector are sums of squares, never 1 - cos^2: narrow lobes and grazing pairs keep their digits.
"""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import inlined
from photogonio.reconstruct.modes.kernel import LANES, TURN, TURN_REST, half_turn, short_sine


@inlined
def both_directions(theta_i, phi_i, theta_r, phi_r, start, count, cos_i, cos_r, sin_i, sin_r, length2, aside):
    """Cosines and sines of both directions, and squared length and tangential part of their sum; lanes beyond
    ``count`` repeat the last."""
    if count == LANES:  # side by side in memory
        first_i, first_r = theta_i[start : start + LANES], theta_r[start : start + LANES]
        turn_i, turn_r = phi_i[start : start + LANES], phi_r[start : start + LANES]
        for j in range(LANES):
            cos_i[j], cos_r[j], aside[j] = first_i[j], first_r[j], turn_r[j] - turn_i[j]
    else:
        for j in range(LANES):
            at = start + min(j, count - 1)
            cos_i[j], cos_r[j], aside[j] = theta_i[at], theta_r[at], phi_r[at] - phi_i[at]
    for j in range(LANES):
        turns = np.rint(aside[j] * (0.5 / math.pi))
        sine = short_sine(0.5 * ((aside[j] - turns * TURN) - turns * TURN_REST))
        aside[j] = 1.0 - sine * sine
    _elevation(cos_i, sin_i)
    _elevation(cos_r, sin_r)
    for j in range(LANES):
        apart, up = sin_i[j] - sin_r[j], cos_i[j] + cos_r[j]
        aside[j] = apart * apart + 4.0 * sin_i[j] * sin_r[j] * aside[j]
        length2[j] = max(up * up + aside[j], 1e-30)


@inlined
def _elevation(theta, sine):
    """Angles up to pi / 2 become their cosines, and their sines are told; by half of the angle, so that a cosine near
    the horizon keeps its digits."""
    for j in range(LANES):
        low, high = half_turn(0.5 * theta[j])
        sine[j] = 2.0 * low * high
        theta[j] = max((high - abs(low)) * (high + abs(low)), 1e-17)


@inlined
def stretch(theta_i, phi_i, theta_r, phi_r, start, count, axes, hidden_i, hidden_r, aside):
    """Tangential parts as the slopes feel them: of both directions times, of their sum over the roughness."""
    along, across, azimuth = axes[0], axes[1], axes[2]
    for j in range(count):
        sin_i, sin_r = hidden_i[j], hidden_r[j]
        x_i, y_i = sin_i * math.cos(phi_i[start + j] - azimuth), sin_i * math.sin(phi_i[start + j] - azimuth)
        x_r, y_r = sin_r * math.cos(phi_r[start + j] - azimuth), sin_r * math.sin(phi_r[start + j] - azimuth)
        hidden_i[j] = math.sqrt((along * x_i) ** 2 + (across * y_i) ** 2)
        hidden_r[j] = math.sqrt((along * x_r) ** 2 + (across * y_r) ** 2)
        aside[j] = ((x_i + x_r) / along) ** 2 + ((y_i + y_r) / across) ** 2
