"""Photos reduced to a facet table, and a direct fit on single pixels of the same photos: the same answer."""

from pathlib import Path

import numpy as np
import pytest

from photogonio.evaluate.bench import direct_table, open_bench
from photogonio.pipeline import process
from photogonio.reconstruct.fit import PhotoErrors, fit_table
from photogonio.reconstruct.table.cells import Cells
from photogonio.run.circumstances import view_errors

pytestmark = [pytest.mark.slow, pytest.mark.long]  # test_binning_error.py holds it on drawn sets


def test_table_and_single_pixels_agree_within_the_binning_error_and_their_own(on_white: Path):
    found = process(on_white)
    bench = open_bench(on_white, found.setup, found.table)
    pixels = direct_table(bench, 8000)
    assert pixels.count.max() == 1.0
    direct = fit_table(pixels, known=PhotoErrors(view_errors(found.setup, pixels), stray=bench.beside.known))
    theta = np.radians(np.arange(2.5, 70.0, 5.0))
    where = Cells.of_angles(
        *(a.ravel() for a in np.meshgrid(theta, theta, np.radians(np.arange(0.0, 181.0, 10.0))))
    )
    weight = (np.sin(2.0 * where.theta_i) * np.sin(2.0 * where.theta_r))[:, None]

    def size(values: np.ndarray) -> np.ndarray:
        return np.sqrt((weight * values**2).sum(0))

    binned, single = (
        fit.brdf.evaluate(where.theta_i, where.phi_i, where.theta_r, where.phi_r)
        for fit in (found.fit, direct)
    )
    reported = np.array(found.fit.diagnostics["binning error"])
    own = [size(fit.standard_error(where)) / size(single) for fit in (found.fit, direct)]
    assert (reported > 0.0).all()
    assert (
        size(binned - single) / size(single) < np.sqrt(reported**2 + 4.0 * (own[0] ** 2 + own[1] ** 2))
    ).all()
