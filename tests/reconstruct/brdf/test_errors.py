"""What a file's errors are at a pair of directions."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import load_brdf
from tests import file_oracle
from tests.drawn.brdfs import RETROS, brdf_of, coat, directions, mirror, uncertain


@pytest.mark.parametrize(
    "lobe", [mirror(0.3), mirror((0.45, 0.2), azimuth=0.5), coat(0.3, distribution="beckmann"), RETROS[0]]
)
def test_errors_of_f_are_what_the_page_says(tmp_path, lobe):
    brdf = uncertain(brdf_of(lobe, symmetry="reciprocal" if lobe.turning else "isotropic", order=1))
    brdf.save(tmp_path / "b.json")
    incident, exit = directions(25, lowest=80.0)
    page = file_oracle.standard_error(tmp_path / "b.json", incident, exit)
    back = load_brdf(tmp_path / "b.json")
    angles = [np.arccos(incident[:, 2]), np.arctan2(incident[:, 1], incident[:, 0])]
    angles += [np.arccos(exit[:, 2]), np.arctan2(exit[:, 1], exit[:, 0])]
    # both take differences, of other steps
    np.testing.assert_allclose(back.standard_error(*angles), page, rtol=1e-3)
