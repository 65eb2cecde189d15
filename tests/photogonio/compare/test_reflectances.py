"""Which file is meant: a result's folder, what stands beside its coefficients, or a file itself."""

import json

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import BESIDE, MOST_NAMED, TABLE, find_brdf, load_known
from photogonio.reconstruct.goniometer.foreign import of_coefficients
from photogonio.synthetic.write.truth import FORMAT as TRUTH_FORMAT


def result(folder):
    folder.mkdir()
    for name in ("coefficients.json", "table.npz", *BESIDE):
        (folder / name).write_text("")
    return folder


def test_a_results_folder_and_what_tells_of_it_mean_its_coefficients(tmp_path):
    folder = result(tmp_path / "a")
    coefficients = folder / "coefficients.json"
    assert [find_brdf(folder), *(find_brdf(folder / name) for name in BESIDE)] == [coefficients] * (
        1 + len(BESIDE)
    )
    for name in ("table.npz", "coefficients.json"):
        assert find_brdf(folder / name) == folder / name
    (folder / "coefficients.json").unlink()
    assert find_brdf(folder / "setup.json") == folder / "setup.json"
    assert find_brdf(folder / "nothing.json") == folder / "nothing.json"


def test_a_rendered_set_means_its_truth(tmp_path):
    (tmp_path / "truth.json").write_text("")
    assert find_brdf(tmp_path) == tmp_path / "truth.json"


def test_a_manifest_means_the_truth_beside_it_or_says_that_it_is_no_brdf(tmp_path):
    manifest = tmp_path / "photoset.toml"
    manifest.write_text('brdf = "none"\n')
    with pytest.raises(InputError, match=r"photoset\.toml.*holds no BRDF; process its folder"):
        find_brdf(manifest)
    (tmp_path / "truth.json").write_text("{}")
    assert find_brdf(manifest) == tmp_path / "truth.json"


def test_of_several_results_one_must_be_named(tmp_path):
    for k in range(MOST_NAMED + 1):
        result(tmp_path / f"s{k}")
    with pytest.raises(InputError, match=r"holds 6 results; name one of them: s0, s1, s2, s3, s4, \.\.\."):
        find_brdf(tmp_path)
    assert find_brdf(tmp_path / "s1").parent.name == "s1"


def test_of_a_table_the_coefficients_beside_it_are_shown(tmp_path):
    for name in ("coefficients.json", TABLE):
        (tmp_path / name).write_text("{}")
    assert find_brdf(tmp_path / TABLE) == tmp_path / TABLE
    assert find_brdf(tmp_path / TABLE, everywhere=True) == tmp_path / "coefficients.json"


@pytest.mark.parametrize("name", ["x" * 300, "a\0b", 3, {"file": "gone.csv"}, None])
def test_a_truth_whose_file_cannot_be_there_is_its_grid(tmp_path, name):
    path = tmp_path / "truth.json"
    grid = {"theta_i": [15.0, 45.0], "theta_r": [15.0, 45.0], "dphi": [30.0, 90.0]}
    grid = grid | {"values": [[0.1, 0.1, 0.1]] * 8}
    path.write_text(json.dumps({"format": TRUTH_FORMAT, "brdf": {"model": {"file": name}, "grid": grid}}))
    assert load_known(path).value.shape == (8, 3)


def test_what_coefficients_leave_out_is_said(tmp_path):
    path = tmp_path / "small.json"
    file = {"format": "surface-scattering-modes", "version": 2, "channels": ["Y"], "scale": "relative"}
    path.write_text(json.dumps(file | {"modes": [[0, 0, 0]], "coefficients": [[1.0]]}))
    assert load_known(path).warnings == (
        "small.json: does not say its quantity, which is taken to be brdf",
        "small.json: does not say its symmetry, which is taken to be isotropic",
    )


@pytest.mark.parametrize("name", ["a.modes", "a", "A.JSON", "a.txt"])
def test_coefficients_are_known_by_what_they_hold(tmp_path, name):
    """Also those that export wrote, called as it was told."""
    told = {"quantity": "brdf", "symmetry": "isotropic", "scale": "absolute"}
    file = {"format": "surface-scattering-modes", "version": 2, "channels": ["Y"]} | told
    text = json.dumps(file | {"modes": [[0, 0, 0]], "coefficients": [[1.0]]})
    for one in (name, "small.json"):
        (tmp_path / one).write_text(text)
    known, same = (load_known(tmp_path / one) for one in (name, "small.json"))
    up = np.array([[0.0, 0.0, 1.0]])
    assert known.channels == same.channels == ("Y",)
    np.testing.assert_array_equal(known.evaluate(up, up), same.evaluate(up, up))
    assert of_coefficients(tmp_path / name) is not None


def test_arrays_are_known_by_what_they_hold(tmp_path):
    angles = np.stack(np.meshgrid([0.2, 0.7], [0.2, 0.7], [0.0, 1.5, 3.0], indexing="ij"), -1).reshape(-1, 3)
    np.savez(tmp_path / "a.npz", grid=angles, brdf=np.full((12, 3), 0.1))
    (tmp_path / "a.grid").write_bytes((tmp_path / "a.npz").read_bytes())
    known, same = (load_known(tmp_path / name) for name in ("a.grid", "a.npz"))
    np.testing.assert_array_equal(known.value, same.value)
