"""Small tables that once gave a wrong answer in silence: each is fitted as the command line does, and has its right
albedo, or is refused, or is not to be trusted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.reconstruct.goniometer.told import Told
from photogonio.result import Result
from photogonio.system.progress import Reporter
from photogonio.tabulated import fit
from tests.places import SHARED

CASES = SHARED / "cases"
RIGHT, WITHIN = 0.540, 0.01  # of the one surface, relative: what its README asks
pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the shared cases are not here")


def fitted(name: str, told: Told = Told()) -> Result:  # noqa: B008  frozen
    return fit(CASES / f"{name}.csv", None, Options(), told=told, reporter=Reporter(quiet=True))


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("plain", Told()),
        ("one-zero", Told()),
        ("zeros-toward-lamp", Told()),
        ("sentinel-999", Told()),
        ("radians", Told(angles="radians")),
        ("percent-of-white", Told(quantity="percent")),
        ("times-cosine", Told(quantity="brdf-cos")),
        ("azimuth-from-mirror-side", Told(azimuth="mirror")),
        ("in-plane-signed", Told(azimuth="mirror")),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)
def test_the_surface_is_found(name, told):
    found = fitted(name, told)
    assert not found.faults
    assert abs(found.brdf.bihemispherical_albedo()[0] / RIGHT - 1.0) < WITHIN


def test_two_wavelengths_are_two_channels():
    albedo = fitted("two-wavelengths", Told(channel_by="wavelength_nm")).brdf.bihemispherical_albedo()
    np.testing.assert_allclose(albedo, (0.270, 0.810), rtol=WITHIN)


def test_noise_that_is_the_same_everywhere_pulls_nothing_down():
    assert abs(fitted("constant-noise").brdf.bihemispherical_albedo()[0] - 0.050) < 0.0005


def test_true_zeros_are_believed():
    found = fitted("dark-with-true-zeros")
    assert not found.faults and not found.diagnoses and len(found.fit.cells) == 648


@pytest.mark.parametrize(
    ("name", "code"), [("percent-of-white", "albedo-above-one"), ("times-cosine", "cosine-in-values")]
)
def test_what_is_another_quantity_is_not_trusted(name, code):
    assert [one.code for one in fitted(name).faults] == [code]


def test_a_peak_toward_the_lamp_is_told():
    assert "table-lamp-side" in [one.code for one in fitted("azimuth-from-mirror-side").diagnoses]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("radians", "--angles radians"),
        ("two-wavelengths", "--channel-by wavelength_nm"),
        ("in-plane-signed", "--azimuth mirror"),
    ],
)
def test_what_cannot_be_taken_for_granted_is_refused(name, said):
    with pytest.raises(InputError, match=said):
        fitted(name)


def test_every_table_is_tried_here():
    text = Path(__file__).read_text(encoding="utf-8")
    assert [path.stem for path in CASES.glob("*.csv") if f'"{path.stem}"' not in text] == []
