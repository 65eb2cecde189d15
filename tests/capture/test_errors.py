"""The one error: a line that names where and what, wherever it is caught."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest

from photogonio.capture.errors import InputError


def test_the_line_names_the_file_and_the_rule():
    error = InputError(Path("set") / "photoset.toml", "expected a table")
    assert str(error) == "set/photoset.toml: expected a table"
    assert (error.where, error.what) == ("set/photoset.toml", "expected a table")
    with pytest.raises(ValueError, match=r"^set/photoset\.toml: "):  # whoever expects bad values catches it
        raise error


@pytest.mark.parametrize("again", [copy.copy, lambda error: pickle.loads(pickle.dumps(error))])
def test_it_comes_whole_from_another_process(again):
    first = InputError("a.png", "cannot be read")
    other = again(first)
    assert type(other) is InputError and str(other) == str(first)
    assert (other.where, other.what) == ("a.png", "cannot be read")


def test_it_is_one_line_whatever_a_file_holds():
    error = InputError("a\nb.png", "wrong checksum of the \x1b3\r\u2028\x85 chunk, 3 ä")
    assert str(error) == r"a\nb.png: wrong checksum of the \x1b3\r\u2028\x85 chunk, 3 ä"
