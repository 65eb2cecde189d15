"""What is told: thresholds, and plain values out and in."""

import json

import pytest

from photogonio.capture.diagnosis import Diagnosis, by_code, from_codes


def test_a_diagnosis_comes_back_from_plain_values():
    told = Diagnosis("vignetting", "dark", 0.1, 0.01, 0.02, 6.0, ("a.png",), True, {"terms": [1.0]})
    assert from_codes(by_code((told, told))) == (told, told)
    assert told.told and told.sureness == pytest.approx(10.0)
    assert not Diagnosis("vignetting", amount=0.05, error=0.01, least=0.02, sigmas=6.0).told


@pytest.mark.parametrize(
    ("amount", "error", "told"),
    [
        (0.021, 0.001, True),
        (0.02, 0.001, False),
        (0.031, 0.005, True),
        (0.03, 0.005, False),
        (-1.0, 0.001, False),
    ],
)
def test_it_is_told_beyond_its_least_and_its_standard_errors(amount, error, told):
    assert Diagnosis("a", amount=amount, error=error, least=0.02, sigmas=6.0).told is told


def test_what_is_counted_is_sure():
    assert Diagnosis("a", amount=2.0).told and Diagnosis("a", amount=2.0).sureness == float("inf")
    assert not Diagnosis("a", amount=0.0).told


def test_what_a_remedy_takes_is_neither_written_nor_compared():
    one, other = (Diagnosis("a", grounds=grounds) for grounds in (object(), None))
    assert one == other and "grounds" not in one.to_dict()
    assert json.loads(json.dumps(by_code((one,)))) == by_code((other,))


@pytest.mark.parametrize(
    ("key", "value"), [("amount", "much"), ("views", 3), ("detail", [1]), ("error", None)]
)
def test_values_of_other_kinds_are_refused(key, value):
    data = Diagnosis("a").to_dict() | {key: value}
    with pytest.raises((KeyError, TypeError, ValueError)):
        Diagnosis.from_dict(data)
    del data[key]
    with pytest.raises(KeyError):
        Diagnosis.from_dict(data)
