"""TOML and JSON that people write: read as meant, or refused in one line that names file and key."""

from __future__ import annotations

import os

import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import DEEPEST, LARGEST, read_json, read_text, read_toml


def written(path, text):
    path.write_text(text, encoding="utf-8")
    return path


def test_both_kinds_say_the_same(tmp_path):
    toml = written(tmp_path / "a.toml", 'name = "a"\nsizes = [1, 2.5]\n[part]\nx = -0.0\n')
    json = written(tmp_path / "a.json", '{"name": "a", "sizes": [1, 2.5], "part": {"x": -0.0}}')
    assert read_toml(toml) == read_json(json) == {"name": "a", "sizes": [1, 2.5], "part": {"x": 0.0}}


def test_the_mark_that_editors_put_first_is_no_text(tmp_path):
    assert read_text(written(tmp_path / "a.toml", "\ufeffx = 1\n")) == "x = 1\n"
    assert read_toml(tmp_path / "a.toml") == {"x": 1}


@pytest.mark.parametrize("lists", [DEEPEST, DEEPEST + 1])
def test_documents_as_deep_as_is_allowed_and_no_deeper(tmp_path, lists):
    """The innermost of so many lists about one number stands ``lists`` below the document's top."""
    path = written(tmp_path / "a.json", "[" * lists + "0" + "]" * lists)
    if lists <= DEEPEST:
        found = read_json(path)
        for _ in range(lists):
            (found,) = found
        assert found == 0
        return
    with pytest.raises(InputError, match=rf"a\.json: nested more than {DEEPEST} deep"):
        read_json(path)


def test_what_is_too_deep_for_the_parser_itself_is_one_line(tmp_path):
    path = written(tmp_path / "a.json", "[" * 200_000)
    with pytest.raises(InputError) as caught:
        read_json(path)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300


@pytest.mark.parametrize("number", [LARGEST - 1, -LARGEST, LARGEST, -LARGEST - 1])
def test_whole_numbers_that_are_slips_are_named_by_their_key(tmp_path, number):
    path = written(tmp_path / "a.json", f'{{"one": [0, {{"two": {number}}}]}}')
    if -LARGEST <= number < LARGEST:
        assert read_json(path)["one"][1]["two"] == number
        return
    with pytest.raises(InputError, match=r"a\.json: one\[1\]\.two: a whole number of 19 digits"):
        read_json(path)


def test_numbers_too_long_to_be_read_are_one_line(tmp_path):
    for read, text in ((read_json, '{"a": 1%s}'), (read_toml, "a = 1%s")):
        with pytest.raises(InputError, match=r"a\.txt: ") as caught:
            read(written(tmp_path / "a.txt", text % ("0" * 5000)))
        assert len(str(caught.value)) < 400


def test_a_key_that_is_there_twice_is_named(tmp_path):
    with pytest.raises(InputError, match=r"a\.txt: not valid JSON: the key 'b' is there twice"):
        read_json(written(tmp_path / "a.txt", '{"a": {"b": 1, "c": 2, "b": 1}}'))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b'name = "\xff"', "not UTF-8 text: invalid start byte at byte 8"),
        (b"x = 1\nx = 2\n", "not valid TOML"),
        (b"x = \n", "not valid TOML: .*line 1"),
    ],
)
def test_what_is_no_document_is_refused_with_its_place(tmp_path, content, said):
    (tmp_path / "a.toml").write_bytes(content)
    with pytest.raises(InputError, match=rf"a\.toml: {said}"):
        read_toml(tmp_path / "a.toml")


def test_what_is_no_file_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for name, said in (("pipe.toml", "is no file"), ("none.toml", "no such file"), (".", "is no file")):
        with pytest.raises(InputError, match=said):
            read_toml(tmp_path / name)
