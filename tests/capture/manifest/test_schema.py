"""Rules of a TOML file: what they let through, to the last number, and how they name what they do not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.manifest import schema
from photogonio.capture.manifest.schema import Key, array, choice, integer, listed, number, per_channel

WHERE = "set/photoset.toml: [board] side"


def refused(rule, value, *said: str) -> None:
    with pytest.raises(InputError) as caught:
        rule(value, WHERE)
    message = str(caught.value)
    assert message.startswith(WHERE) and "\n" not in message and len(message) < 250
    for piece in said:
        assert piece in message


def test_bounds_hold_to_the_next_number():
    """``above`` and ``below`` are open, ``low`` and ``high`` are not."""
    least, most = 0.0, 1.5
    up, down = math.nextafter(least, 1), math.nextafter(most, 0)
    opened, closed = number(above=least, below=most), number(low=least, high=most)
    for value in (up, down, 1):
        assert opened(value, WHERE) == closed(value, WHERE) == value
    for value in (least, most):
        refused(opened, value, "above 0", "below 1.5")
        assert closed(value, WHERE) == value
    for value in (math.nextafter(least, -1), math.nextafter(most, 2), math.inf, math.nan):
        refused(opened, value, "finite")
        refused(closed, value, "of at least 0", "of at most 1.5")


@pytest.mark.parametrize("rule", [number(), integer(), per_channel()])
@pytest.mark.parametrize("value", [True, "1", {"a": 1}, [["1"]]])
def test_truth_and_text_are_no_numbers(rule, value):
    refused(rule, value, "expected")


def test_whole_numbers_and_their_limits():
    rule = integer(low=2, high=5)
    assert [rule(value, WHERE) for value in (2, 5)] == [2, 5]
    for value in (1, 6):
        refused(rule, value, "at least 2 and at most 5", str(value))
    refused(rule, 3.0, "whole number")


def test_lists_name_the_item_at_fault():
    rule = listed(number(above=0.0), least=2, most=3)
    assert rule([1, 2], WHERE) == (1.0, 2.0)
    refused(rule, [1, -2, 3], "side[1]: ", "-2")
    for value in ([1], [1, 2, 3, 4], 1, ()):
        refused(rule, value, "2 to 3 values")
    refused(listed(integer(), least=2, most=2), [1], "a list of 2 values")


@pytest.mark.parametrize(
    ("shape", "value", "fits"),
    [
        ((3,), [1, 2, 3], True),
        ((3,), [1, 2], False),
        ((None, 2), [[1, 2]], True),
        ((None, 2), [[1, 2], [3]], False),
        ((None, 2), [1, 2], False),
        ((2, 2), [[1, 2], [3, True]], False),
        ((2,), [1, float("nan")], False),
        ((2,), "12", False),
    ],
)
def test_arrays_are_of_their_shape_and_finite(shape, value, fits):
    if fits:
        assert array(*shape)(value, WHERE).tolist() == np.array(value, float).tolist()
    else:
        refused(array(*shape), value, " x ".join("n" if n is None else str(n) for n in shape))


def test_one_number_or_one_a_channel_is_always_a_tuple():
    rule = per_channel(high=1.5)
    assert rule(1, WHERE) == (1.0,) and rule([0.5, 1.5], WHERE) == (0.5, 1.5)
    refused(rule, [0.5, 1.6], "side[1]")


def test_tables_name_what_is_unknown_and_what_is_missing():
    keys = {"side": Key(number(above=0.0), required=True), "name": Key(schema.text)}
    read = schema.table(keys, lambda values, where: values)
    assert read({"side": 2, "name": "x"}, "[board]") == {"side": 2.0, "name": "x"}
    for value, said in (
        ({"sied": 2}, "unknown key 'sied'; did you mean 'side'?"),
        ({"q": 2}, "unknown key 'q'; known here: side, name"),
        ({"name": "x"}, "the key 'side' is required"),
        ({"side": 0}, "[board] side: expected"),
        (3, "expected a table"),
    ):
        with pytest.raises(InputError) as caught:
            read(value, "[board]")
        assert str(caught.value).startswith("[board]") and said in str(caught.value)
    many = schema.tables(keys, lambda values, where: where)
    assert many([{"side": 1}, {"side": 2}], "ball") == ("ball[0]", "ball[1]")
    with pytest.raises(InputError, match=r"ball\[1\] side"):
        many([{"side": 1}, {"side": -1}], "ball")


def test_words_near_a_known_one_are_guessed():
    rule = choice("sphere", "plane")
    assert rule("plane", WHERE) == "plane"
    refused(rule, "spere", '"sphere", "plane"', "did you mean 'sphere'?")
    refused(rule, ["plane"], "expected one of")
    refused(schema.text, "  ", "expected text")
    refused(schema.boolean, 1, "expected true or false")


def test_long_values_are_shown_short():
    assert len(schema.shown("x" * 1000)) == 60
