"""Small rooms for the renderer's tests."""

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.synthetic.render.print import print_of
from photogonio.synthetic.render.room import World


def room(
    *,
    sphere=(0.0, 0.0, 0.0, 0.0),
    balls=(),
    outlines=(),
    heights=(),
    sample_sheet=-1,
    sheet_colors=(),
    lamps=(),
    intensity=(),
    ambient=0.0,
    board=None,
    table_radius=0.0,
    plain=(0.04, 0.85, 0.05, 0.04),
) -> World:
    """A world of one channel; ``lamps`` (kind, x, y, z, radius), their ``intensity`` one number each."""
    rows = [[*sphere, 0.0], *balls]
    return World(
        page=print_of(board),
        colors=np.array([*plain, *sheet_colors], float)[:, None],
        table_radius=float(table_radius),
        balls=np.array(rows, float),
        outlines=np.asarray(outlines, float).reshape(len(outlines), -1, 2)
        if len(outlines)
        else np.zeros((0, 3, 2)),
        heights=np.array(heights, float),
        sample_sheet=sample_sheet,
        lamps=np.array(lamps, float).reshape(-1, 5),
        intensity=np.array(intensity, float).reshape(-1, 1),
        ambient=np.array([float(ambient)]),
    )


def camera(width=160, height=120, focal=400.0, distortion=()) -> Camera:
    matrix = np.array([[focal, 0, 0.5 * (width - 1)], [0, focal, 0.5 * (height - 1)], [0, 0, 1.0]])
    return Camera(matrix, np.array(distortion, float), (width, height))


def overhead(distance: float) -> Pose:
    """A camera above the origin that looks straight down, the board's y up in the picture."""
    return Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, distance]))
