"""Zemax's tabular BSDF: a grid about the mirror direction, against a surface that is known at every pair."""

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import load_known
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from tests.drawn.goniometer import glossy

SATIN = glossy(0.3, 0.1, 20.0)
INCIDENT = (0.0, 20.0, 50.0)
RADIAL = (0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 70.0, 100.0, 140.0)


def pair_of(incident: float, azimuth: float, radial: float) -> tuple[float, float]:
    """theta_r and dphi, radians, by the cosine rule on the sphere: mirror direction, normal, exit."""
    tilt, rho, psi = np.radians([incident, radial, azimuth])
    theta_r = np.arccos(
        np.clip(np.cos(tilt) * np.cos(rho) + np.sin(tilt) * np.sin(rho) * np.cos(psi), -1.0, 1.0)
    )
    bottom = np.sin(tilt) * np.sin(theta_r)
    if bottom < 1e-12:
        return theta_r, 0.0
    from_mirror = np.arccos(np.clip((np.cos(rho) - np.cos(tilt) * np.cos(theta_r)) / bottom, -1.0, 1.0))
    return theta_r, np.pi - from_mirror


def value_of(incident: float, azimuth: float, radial: float) -> float:
    theta_r, dphi = pair_of(incident, azimuth, radial)
    if theta_r > np.pi / 2:
        return 0.0
    return float(SATIN(np.radians([incident]), np.array([theta_r]), np.array([dphi]))[0])


def text_of(
    azimuth, *, symmetry="PlaneSymmetrical", spectral="Monochrome", kind="BRDF", rotations="1\n0"
) -> str:
    names = ["Monochrome"] if spectral == "Monochrome" else ["TristimulusX", "TristimulusY", "TristimulusZ"]
    blocks = []
    for k, name in enumerate(names):
        rows = []
        for incident in INCIDENT:
            rows.append("TIS 0.4")
            rows += [
                "\t".join(f"{(k + 1) * value_of(incident, psi, rho):.6e}" for rho in RADIAL)
                for psi in azimuth
            ]
        blocks.append("\n".join([name, "DataBegin", *rows, "DataEnd"]))
    lists = [("AngleOfIncidence", INCIDENT), ("ScatterAzimuth", azimuth), ("ScatterRadial", RADIAL)]
    head = f"# by hand\nSource  Measured\nSymmetry  {symmetry}\nSpectralContent  {spectral}\nScatterType  {kind}\n"
    head += f"SampleRotation  {rotations}\n"
    head += "".join(f"{name} {len(one)}\n{'   '.join(f'{x:g}' for x in one)}\n" for name, one in lists)
    return head + "\n" + "\n".join(blocks) + "\n"


HALF, WHOLE = (0.0, 30.0, 90.0, 150.0, 180.0), (0.0, 45.0, 90.0, 180.0, 225.0, 270.0, 360.0)


@pytest.mark.parametrize(("azimuth", "symmetry"), [(HALF, "PlaneSymmetrical"), (WHOLE, "Asymmetrical")])
@pytest.mark.parametrize("spectral", ["Monochrome", "XYZ"])
def test_directions_and_values(tmp_path, azimuth, symmetry, spectral):
    path = tmp_path / "satin.bsdf"
    path.write_text(text_of(azimuth, symmetry=symmetry, spectral=spectral))
    samples = read_samples(path)
    assert samples.channels == (("Y",) if spectral == "Monochrome" else ("X", "Y", "Z"))
    true = SATIN(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i)
    for k, value in enumerate(samples.value.T):
        np.testing.assert_allclose(value, (k + 1) * true, rtol=1e-5)
    assert samples.theta_r.max() < np.pi / 2 and samples.diagnoses == () and samples.left_out == 0
    # each incident angle's mirror direction once, and azimuths 0 and 360 once
    unique = len(azimuth) - (360.0 in azimuth)
    above = sum(
        pair_of(i, psi, rho)[0] < np.pi / 2 - 1e-3
        for i in INCIDENT
        for psi in azimuth[:unique]
        for rho in RADIAL[1:]
    )
    assert len(samples.value) == above + len(INCIDENT)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_long_remarks_and_other_letters(tmp_path, encoding):
    path = tmp_path / "satin.bsdf"
    text = text_of(HALF)
    path.write_text(text, encoding="utf-8")
    plain = read_samples(path).value
    other = text.replace("Symmetry", "SYMMETRY").replace("ScatterRadial", "scatterradial")
    path.write_text("# remark\n" * 2000 + other, encoding=encoding)
    np.testing.assert_array_equal(read_samples(path).value, plain)


def test_it_is_compared_and_says_itself_what_it_holds(tmp_path):
    path = tmp_path / "satin.bsdf"
    path.write_text(text_of(HALF))
    assert load_known(path).at is not None
    with pytest.raises(InputError, match="says itself what it holds"):
        read_samples(path, Told(quantity="percent"))


GOOD = text_of(HALF)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (text_of(HALF, kind="BTDF"), "of transmission"),
        (text_of(HALF, rotations="2\n0 90"), "several rotations"),
        (text_of(HALF, symmetry="Round"), "Symmetry: expected"),
        (GOOD.replace("SpectralContent  Monochrome", "SpectralContent  RGB"), "SpectralContent: expected"),
        (GOOD[: len(GOOD) // 2], "ends before the incident angle number"),
        (GOOD.replace("TIS 0.4", "TIS", 1), "expected"),
        (GOOD.replace("ScatterRadial 9", "ScatterRadial 8"), "expected monochrome, found '140'"),
        (GOOD.replace("ScatterRadial 9", "ScatterRadial 10"), "expected 10 numbers for ScatterRadial"),
        (GOOD.replace("Incidence 3\n0   20", "Incidence 3\n0   120"), "AngleOfIncidence: expected 0 to 90"),
        (GOOD.replace("ScatterAzimuth 5", "ScatterAzimuth 99999999"), "expected how many there are"),
    ],
)
def test_damage_is_named(tmp_path, text, said):
    path = tmp_path / "satin.bsdf"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as error:
        read_samples(path)
    assert "\n" not in str(error.value)
