"""pab-opto's files: one an incident direction."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import load_known
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import Told
from tests.drawn.goniometer import SATIN, satin


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


def test_columns_stand_in_the_order_that_the_format_names(tmp_path):
    for theta in (10.0, 40.0):
        lines = pabopto(theta, 0.0).replace("theta phi", "phi theta").splitlines()
        turned = [
            one if one.startswith("#") else " ".join([*one.split()[1::-1], *one.split()[2:]]) for one in lines
        ]
        (tmp_path / f"{theta:g}.dat").write_text("\n".join(turned), encoding="utf-16")
    samples = read_samples(tmp_path)
    np.testing.assert_allclose(samples.value[:, 0], satin(samples.incident, samples.exit)[:, 0], rtol=1e-6)


def test_one_pabopto_file_and_comparison(tmp_path):
    path = tmp_path / "m.txt"
    path.write_text(pabopto(30.0, 0.0))
    known = load_known(path)
    assert known.at is not None and known.value.shape == (108, 1)
    with pytest.raises(InputError, match="says itself what it holds"):
        read_samples(path, Told(quantity="percent"))


def test_a_file_of_the_folder_that_lost_its_header_is_named(tmp_path):
    for theta in (10.0, 30.0):
        (tmp_path / f"{theta:g}.dat").write_text(pabopto(theta, 0.0))
    (tmp_path / "50.dat").write_bytes(b"")
    assert any("50.dat" in one.message for one in read_samples(tmp_path).diagnoses)
