"""A photo that the others contradict is seen in the table of photos."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.table.cells import Cells
from photogonio.report.viewer.photo_fit import photo_fit


def test_a_photo_that_is_a_tenth_too_bright_says_so():
    rng = np.random.default_rng(2)
    theta = rng.uniform(0.1, 1.2, 300)
    group = np.arange(300) % 3
    said = 0.2 + 0.1 * np.cos(theta)[:, None] * [1.0, 0.5]
    seen = said * (1.0 + 0.002 * rng.normal(size=said.shape)) * np.where(group == 1, 1.1, 1.0)[:, None]
    cells = replace(
        Cells.of_angles(theta, theta, theta), value=seen, group=group, groups=("a", "b", "c", "empty")
    )
    section = photo_fit(cells, said, np.where(group == 1, 0.5, 1.0)[:, None] * np.ones(2))
    rows = {name: [cell.rstrip(" %") for cell in row] for name, *row in section.table.rows}
    # medians of 100 cells with noise of 0.2 % are known to 0.025 %
    assert [float(rows[name][1]) for name in "abc"] == pytest.approx([0.0, 10.0, 0.0], abs=0.15)
    assert float(rows["a"][2]) < 0.3 < float(rows["b"][2])
    assert [float(rows[name][3]) for name in "abc"] == [1.0, 0.5, 1.0]
    assert rows["empty"] == ["0", "–", "–", "–"]


def test_a_table_is_no_photos():
    cells = Cells.of_angles(*np.full((3, 4), 0.5))
    assert photo_fit(cells, np.ones((4, 1)), np.ones((4, 1))) is None
