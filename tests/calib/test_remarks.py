"""What is told at the end: in order, by code, with what a person needs of it."""

import pytest

from photogonio.calib.remarks import LeftOut, Remarks, listed


@pytest.mark.parametrize(
    ("count", "shown"), [(0, ""), (1, "p0"), (4, "p0, p1, p2, p3"), (5, "p0, p1, p2, p3, ...")]
)
def test_the_first_few_names_are_listed(count, shown):
    assert listed([f"p{k}" for k in range(count)]) == shown


def test_amounts_are_the_diagnosis_and_all_else_is_detail():
    remarks = Remarks()
    remarks.tell(
        "board-bent", "bent", amount=0.03, error=0.001, least=0.002, sigmas=6.0, allowed=True, axis="x"
    )
    (one,) = remarks.diagnoses
    assert (one.amount, one.error, one.least, one.sigmas, one.allowed) == (0.03, 0.001, 0.002, 6.0, True)
    assert one.detail == {"axis": "x"} and one.told


def test_a_photo_left_out_is_named_with_its_reason_and_told():
    remarks = Remarks()
    remarks.tell("board-bent", "bent")
    remarks.leave_out("a.png", "it is dark", "dark-photo")
    assert remarks.left_out == [LeftOut("a.png", "it is dark")]
    assert remarks.warnings == ("bent", "a.png: left out, it is dark")
    assert remarks.codes() == ["board-bent", "dark-photo"] and remarks.diagnoses[1].views == ("a.png",)


def test_reasons_are_few_and_never_nothing():
    remarks = Remarks()
    assert remarks.reasons() == "none has a light that can be found"
    for k in range(5):
        remarks.leave_out(f"p{k}", "why", "dark-photo")
    assert remarks.reasons() == "p0: why; p1: why; p2: why"
