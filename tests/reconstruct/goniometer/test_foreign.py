"""Files of other programs: read by what they hold, or refused by their own name."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import load_known
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import bin_values, is_merl, write_merl
from photogonio.reconstruct.export.openpbr import write_openpbr
from photogonio.reconstruct.goniometer.foreign import read_foreign
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.lobes.lobe import Lobe
from tests.drawn.goniometer import satin


def test_merl_is_read_at_pairs_of_directions(tmp_path):
    path = tmp_path / "satin.binary"
    write_merl(path, bin_values(satin))
    samples = read_samples(path)
    assert (
        samples.channels == ("R", "G", "B") and 1000 < len(samples.value) < 5000 and samples.diagnoses == ()
    )
    # a bin is up to two degrees wide, in which f changes by 10 % at most
    np.testing.assert_allclose(samples.value, satin(samples.incident, samples.exit), rtol=0.12)
    assert np.median(np.abs(samples.value / satin(samples.incident, samples.exit) - 1.0)) < 0.005


def test_merl_is_known_by_what_it_holds(tmp_path):
    path = tmp_path / "satin.dat"
    write_merl(path, np.full((90, 90, 180, 3), 0.1))
    assert is_merl(path) and read_samples(path).channels == ("R", "G", "B")
    path.write_bytes(path.read_bytes()[:-8])
    assert not is_merl(path)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.bsdf", "Symmetry Asymmetric\nSpectralContent Monochrome\nScatterAzimuth 3\n0 90 180\nScatterRadial 3\n"
         "0 45 90\nDataBegin\nAOI 10\nPOI 0\nSide Front\n", "LightTools"),
        ("a.brdf", "OPTIS - brdf surface file v9.0\n0\nScattering surface\n", "Ansys Speos"),
        ("a.brdf", "OPTIS - Anisotropic BSDF surface file v7.0\n0\nComment\n", "Ansys Speos"),
        ("a.brdf", "\xef\xbb\xbfoptis - BRDF surface file v9.0\n0\n", "Ansys Speos"),
        ("a.anisotropicbsdf", "1 2 3\n4 5 6\n", "Ansys Speos"),
        ("a.astm", "SAMPLE_NAME x\nNUM_POINTS 3\nVARS theta_s,BRDF\n10,0.1\n20,0.1\n", "column 'theta_i' is not among"),
        ("b.bsdf", "tensor_file\0\x01\0", "no tensor file"),
        ("t.xlsx", "PK\x03\x04....", "spreadsheet"),
        ("p.dat", "#intheta 30\n#format: theta phi photons\n1 2 3\n", "expected theta phi and DSF"),
        ("p.dat", "#sample_name x\n#format: theta phi BSDF\n1 2 3\n", "no incident direction"),
        ("p.dat", "#intheta 30\n#inphi 0\n#format: theta phi BSDF\n1 2 x\n", "not numbers"),
        ("p.dat", "#intheta 30\n#inphi 0\n#format: theta phi BSDF\n1 2 3 4\n", "4 columns"),
        ("p.dat", "#intheta 30\n#inphi 0\n#format: theta phi BTDF\n1 2 3\n", "expected theta phi and DSF"),
        ("p.dat", "#intheta 30\n#inphi 0\n#format: x y BSDF\n1 2 3\n", "expected theta phi and DSF"),
        ("p.dat", "#intheta 0.5 rad\n#inphi 0\n#format: theta phi BSDF\n1 2 3\n", "expected degrees"),
        ("m.json", '[{"theta_i": 1}]', "no coefficient file"),
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


def test_a_material_of_two_roughnesses_is_said_to_turn(tmp_path):
    for name, axes in (("brushed", (0.35, 0.15)), ("plain", 0.25)):
        lobe = Lobe(axes, np.array([0.9, 0.7, 0.5]), np.ones(3))
        none = np.empty((0, 3))
        write_openpbr(Brdf(0, ("R", "G", "B"), none.astype(int), none, none, lobes=(lobe,)), tmp_path / name)
        path = (tmp_path / name).rename(tmp_path / f"{name}.mtlx")
        assert load_known(path).isotropic == (name == "plain")
