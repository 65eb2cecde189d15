"""Scatter files in the manner of ASTM E1392: keywords, VARS, rows."""

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from tests.drawn.goniometer import glossy, regular

SATIN = glossy(0.3, 0.1, 20.0)
HEAD = "SAMPLE_NAME satin\nWAVELENGTH 0.633, um\nNUM_POINTS 648\nVARS theta_i,phi_i,theta_s,phi_s,{names}\n"


def text_of(names="Red,Green,Blue", *, degrees=True) -> str:
    """The light comes from azimuth 180, so that 0 is forward."""
    theta_i, theta_r, dphi = regular()
    angles = np.column_stack([theta_i, np.full_like(theta_i, np.pi), theta_r, dphi - np.pi])
    value = SATIN(theta_i, theta_r, dphi)[:, None] * np.arange(1, names.count(",") + 2)
    rows = np.hstack([np.degrees(angles) if degrees else angles, value])
    return HEAD.format(names=names) + "\n".join(",".join(f"{x:.9g}" for x in row) for row in rows) + "\n"


@pytest.mark.parametrize("names", ["Red,Green,Blue", "BRDF"])
def test_columns_are_those_of_vars(tmp_path, names):
    path = tmp_path / "satin.astm"
    path.write_text(text_of(names))
    samples = read_samples(path)
    assert samples.channels == tuple(names.split(",")) and samples.diagnoses == ()
    assert samples.lines[0, 0] == 5
    true = SATIN(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i)
    np.testing.assert_allclose(samples.value[:, 0], true, rtol=1e-6)


def test_transmission_and_a_long_head(tmp_path):
    path = tmp_path / "satin.astm"
    path.write_text(text_of("BTDF"))
    with pytest.raises(InputError, match="'BTDF' is of transmission"):
        read_samples(path)
    remarks = "".join(f"REMARK {k}\n" for k in range(1000))
    path.write_text(remarks + text_of("BRDF"))
    assert read_samples(path).lines[0, 0] == 1005


def test_radians_are_asked_about(tmp_path):
    path = tmp_path / "satin.astm"
    path.write_text(text_of(degrees=False))
    with pytest.raises(InputError, match="are these radians"):
        read_samples(path)
    samples = read_samples(path, Told(angles="radians"))
    true = SATIN(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i)
    np.testing.assert_allclose(samples.value[:, 0], true, rtol=1e-6)
