"""Everything that stands in the room, as arrays for the compiled code."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from photogonio.synthetic.render.print import PrintedPage

NOTHING, BOARD, TABLE, SHEET, SAMPLE, BALL, SIDE = range(7)  # what a ray meets
INK, PAPER, TABLETOP, WALL, FIRST_SHEET = range(5)  # rows of World.colors
FAR = 1e30
NO_SHADES = np.zeros((0, 5))


class World(NamedTuple):
    """The room in the world frame."""

    page: PrintedPage
    colors: np.ndarray  # (4 + p, c) reflectances: ink, paper, table, walls of sheets, each sheet
    table_radius: float  # of the table, the plane z = 0 about the origin; 0: none
    balls: (
        np.ndarray
    )  # (1 + n, 5) centre, radius, reflectance; the sample first, radius 0 where it is no ball
    outlines: np.ndarray  # (p, v, 2) raised sheets: corners counter-clockwise, the last one repeated
    heights: np.ndarray  # (p,)
    sample_sheet: int  # the sheet that is the sample, or -1
    lamps: (
        np.ndarray
    )  # (k, 5) kind (0 point, 1 directional), place or direction, radius (angular if directional)
    intensity: np.ndarray  # (k, c) radiance units x length^2 (point) or irradiance (directional)
    ambient: np.ndarray  # (c,) radiance of the room itself, on all sides
    shades: np.ndarray = (
        NO_SHADES  # (k, 5) axis that the light leaves along, half angle and rim, radians; or none
    )
    curl: float = 0.0  # the page's height is curl x^2 about its middle line, x across it, 1 / length units
