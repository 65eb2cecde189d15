"""Files of other programs: read by what they hold, or refused by their own name."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import load_known
from photogonio.reconstruct.brdf.merl import write_merl
from photogonio.reconstruct.goniometer.foreign import read_foreign
from photogonio.reconstruct.goniometer.merged import MOST, merged
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.modes.angles import pair_angles
from tests.drawn.goniometer import glossy, measured, scattered

SATIN = glossy(0.3, 0.1, 20.0)


def satin(incident, exit):
    theta_i, theta_r, dphi = pair_angles(incident, exit)
    return np.repeat(SATIN(theta_i, theta_r, dphi)[:, None], 3, axis=1)


def test_merl_is_read_at_pairs_of_directions(tmp_path):
    path = tmp_path / "satin.binary"
    write_merl(path, satin)
    samples = read_samples(path)
    assert (
        samples.channels == ("R", "G", "B") and 1000 < len(samples.value) < 5000 and samples.diagnoses == ()
    )
    # a bin is up to two degrees wide, in which f changes by 10 % at most
    np.testing.assert_allclose(samples.value, satin(samples.incident, samples.exit), rtol=0.12)
    assert np.median(np.abs(samples.value / satin(samples.incident, samples.exit) - 1.0)) < 0.005


def pabopto(theta: float, phi: float, kind: str = "BSDF", colour: str = "") -> str:
    exit_theta, exit_phi = np.meshgrid(np.arange(0, 81, 10.0), np.arange(0, 360, 30.0))
    f = SATIN(np.radians(theta), np.radians(exit_theta.ravel()), np.radians(exit_phi.ravel() - phi))
    factor = np.cos(np.radians(exit_theta.ravel())) if kind == "DSF" else 1.0
    rows = np.column_stack(
        [exit_theta.ravel(), exit_phi.ravel(), *([f * factor] * (3 if colour == "CIE-XYZ" else 1))]
    )
    head = f'#sample_name "satin"\n#intheta {theta}\n#inphi {phi}\n#format: theta phi {kind}\n'
    head += f"#colorimetry: {colour}\n" if colour else ""
    return (
        head
        + "\n".join(" ".join(f"{x:.8g}" for x in row) for row in [*rows, [120.0, 0.0, *rows[0, 2:]]])
        + "\n"
    )


@pytest.mark.parametrize("kind", ["BSDF", "DSF"])
@pytest.mark.parametrize("colour", ["", "CIE-XYZ"])
def test_a_folder_of_pabopto_files(tmp_path, kind, colour):
    for k, theta in enumerate((10.0, 30.0, 50.0)):
        (tmp_path / f"m{k}.dat").write_text(pabopto(theta, 20.0 * k, kind, colour))
    (tmp_path / "readme.txt").write_text("not one of them")
    samples = read_samples(tmp_path)
    assert samples.channels == (("X", "Y", "Z") if colour else ("Y",))
    assert len(samples.value) == 3 * 9 * 12 and samples.left_out == 3
    np.testing.assert_allclose(samples.value[:, 0], satin(samples.incident, samples.exit)[:, 0], rtol=1e-6)


def test_one_pabopto_file_and_comparison(tmp_path):
    path = tmp_path / "m.txt"
    path.write_text(pabopto(30.0, 0.0))
    known = load_known(path)
    assert known.at is not None and known.value.shape == (108, 1)
    with pytest.raises(InputError, match="says itself what it holds"):
        read_samples(path, Told(quantity="percent"))


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.bsdf", "Source Measured\nSymmetry PlaneSymmetrical\nSampleRotation 1\n0\nAngleOfIncidence 2\n0 30\n"
         "ScatterAzimuth 3\n0 90 180\nScatterRadial 3\n0 45 90\nMonochrome\nDataBegin\n", "Zemax OpticStudio"),
        ("a.brdf", "OPTIS - brdf surface file v9.0\n0\nScattering surface\n", "Ansys Speos"),
        ("a.brdf", "OPTIS - Anisotropic BSDF surface file v7.0\n0\nComment\n", "Ansys Speos"),
        ("a.astm", "SAMPLE_NAME x\nNUM_POINTS 3\nVARS theta_i,phi_i,theta_s,phi_s,Y\n10,0,20,0,0.1\n", "ASTM E1392"),
        ("b.bsdf", "tensor_file\0\x01\0", "no tensor file"),
        ("t.xlsx", "PK\x03\x04....", "spreadsheet"),
        ("p.dat", "#intheta 30\n#format: theta phi photons\n1 2 3\n", "expected theta phi and DSF"),
        ("p.dat", "#sample_name x\n#format: theta phi BSDF\n1 2 3\n", "no incident direction"),
        ("p.dat", "#intheta 30\n#inphi 0\n#format: theta phi BSDF\n1 2 x\n", "not numbers"),
        ("p.dat", "#intheta 30\n#inphi 0\n#format: theta phi BSDF\n1 2 3 4\n", "4 columns"),
        ("m.binary", "short", "no MERL table"),
    ],
)  # fmt: skip
def test_other_programs_files_are_refused_by_name(tmp_path, name, text, said):
    path = tmp_path / name
    path.write_bytes(text.encode("latin-1"))
    for read in (read_samples, load_known):
        with pytest.raises(InputError, match=said) as error:
            read(path)
        assert "\n" not in str(error.value)


def test_a_text_table_is_none_of_them(tmp_path):
    path = tmp_path / "t.csv"
    path.write_text("# VARS of the room\ntheta_i,phi_i,theta_r,phi_r,f\n10,0,20,0,0.1\n")
    assert read_foreign(path) is None


def test_very_many_rows_are_joined():
    """Means of neighbours: values of the mean direction but for the curvature within a cell, noise as of a mean."""
    table = measured(SATIN, scattered(60000), noise=0.02)
    joined = merged(table)
    assert MOST / 4 < len(joined.value) <= MOST and "60000 rows joined" in joined.notes[-1]
    true = satin(joined.incident, joined.exit)[:, 0]
    ratio = joined.value[:, 0] / true
    assert abs(np.mean(ratio) - 1.0) < 0.002 and np.std(ratio) < 0.02
    few = measured(SATIN, scattered(1000))
    assert merged(few) is few
