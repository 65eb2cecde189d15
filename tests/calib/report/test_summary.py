"""What is told of a calibration: drawn set-ups, each with one fault."""

from __future__ import annotations

from tests.drawn.calibrations import Drawn


def test_a_good_set_is_not_complained_of():
    drawn = Drawn(3)
    drawn.settled()
    # the drawn photos of the board do leave the pictures' corners empty
    assert set(drawn.remarks.codes()) <= {"corners-in-middle"}
    assert drawn.remarks.left_out == []
