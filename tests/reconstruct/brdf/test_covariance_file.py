"""The covariance beside a file: its own, whole, told where it is not there."""

from __future__ import annotations

import errno
import json
import os

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.brdf.covariance_file import BESIDE, MOST_INSIDE, write_whole
from photogonio.reconstruct.brdf.spread import albedo_error, drawn
from tests.drawn.brdfs import brdf_of, mirror, uncertain


def many(seed: int = 3):
    """Of more parameters than a file holds the covariance of."""
    brdf = uncertain(brdf_of(mirror(0.3), order=14), seed=seed)
    assert len(brdf.uncertainty.parameters) > MOST_INSIDE
    return brdf


def test_many_parameters_have_their_covariance_beside_the_file(tmp_path):
    brdf = many()
    brdf.save(tmp_path / "coefficients.json")
    assert "channels" not in json.loads((tmp_path / "coefficients.json").read_text())["covariance"]
    back = load_brdf(tmp_path / "coefficients.json")
    np.testing.assert_array_equal(back.uncertainty.covariance, brdf.uncertainty.covariance)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["coefficients.json", BESIDE]


def test_two_files_of_one_folder_have_each_its_own_covariance(tmp_path):
    first, second = many(3), many(9)
    first.save(tmp_path / "a.json")
    second.save(tmp_path / "b.json")
    first.save(tmp_path / "a.json")  # again, in its own place
    for name, brdf in (("a.json", first), ("b.json", second)):
        back = load_brdf(tmp_path / name)
        np.testing.assert_array_equal(back.uncertainty.covariance, brdf.uncertainty.covariance)
    assert (tmp_path / BESIDE).is_file() and (tmp_path / f"b.{BESIDE}").is_file()


def test_a_result_leaves_the_covariance_of_another_file_alone(tmp_path):
    first, second = many(3), many(9)
    first.save(tmp_path / "a.json")
    second.save(tmp_path / "coefficients.json")
    for name, brdf in (("a.json", first), ("coefficients.json", second)):
        back = load_brdf(tmp_path / name)
        np.testing.assert_array_equal(back.uncertainty.covariance, brdf.uncertainty.covariance)


@pytest.mark.parametrize("place", [100, 400, 2000])
def test_a_damaged_covariance_is_one_clear_line(tmp_path, place):
    many().save(tmp_path / "coefficients.json")
    data = bytearray((tmp_path / BESIDE).read_bytes())
    data[place] ^= 255
    (tmp_path / BESIDE).write_bytes(data)
    with pytest.raises(InputError, match=r"covariance"):
        load_brdf(tmp_path / "coefficients.json")


def test_a_name_that_no_file_can_have_is_refused(tmp_path):
    many().save(tmp_path / "coefficients.json")
    document = json.loads((tmp_path / "coefficients.json").read_text())
    document["covariance"]["file"] = 300 * "a"
    (tmp_path / "coefficients.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"coefficients\.json: covariance\.file"):
        load_brdf(tmp_path / "coefficients.json")


def test_a_covariance_of_other_coefficients_is_refused(tmp_path):
    many().save(tmp_path / "coefficients.json")
    (tmp_path / "other").mkdir()
    many(9).save(tmp_path / "other" / "coefficients.json")
    os.replace(tmp_path / "other" / BESIDE, tmp_path / BESIDE)
    with pytest.raises(InputError, match=r"covariance: covariance\.npz beside it is of other coefficients"):
        load_brdf(tmp_path / "coefficients.json")
    document = json.loads((tmp_path / "coefficients.json").read_text())
    del document["covariance"]["sha256"]  # as a file may be that knows no hash
    (tmp_path / "coefficients.json").write_text(json.dumps(document))
    with pytest.raises(
        InputError, match=r"covariance: covariance\.npz beside it is of other standard errors"
    ):
        load_brdf(tmp_path / "coefficients.json")
    (tmp_path / BESIDE).write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"covariance\.npz: cannot be read as the covariance"):
        load_brdf(tmp_path / "coefficients.json")


def test_a_missing_covariance_is_told_and_still_named_by_a_copy(tmp_path):
    many().save(tmp_path / "coefficients.json")
    (tmp_path / BESIDE).unlink()
    alone = load_brdf(tmp_path / "coefficients.json")
    assert np.isnan(alone.standard_error(0.1, 0.0, 0.2, 0.3)).all() and np.isnan(albedo_error(alone)).all()
    with pytest.raises(InputError, match=r"covariance\.npz is missing"):
        drawn(alone, 1, 0)
    alone.save(tmp_path / "copy.json")
    named = [
        json.loads((tmp_path / name).read_text())["covariance"] for name in ("coefficients.json", "copy.json")
    ]
    assert named[0] == named[1] and named[0]["file"] == BESIDE


def test_a_file_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match="there is no folder"):
        many().save(tmp_path / "none" / "a.json")
    (tmp_path / "a.json").mkdir()
    with pytest.raises(InputError, match=r"a\.json: cannot be written"):
        brdf_of(mirror(0.3)).save(tmp_path / "a.json")
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_a_full_disk_is_nobodys_input(tmp_path):
    """The exit status of bad input is another than that of what failed: so it is another error."""

    def full(file):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(OSError, match="No space left"):
        write_whole(tmp_path / "a.json", full)
    assert list(tmp_path.iterdir()) == []
