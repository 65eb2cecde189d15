"""What is told of sets of one rig stands among all codes, with what to do."""

from photogonio.calib.rig.codes import DIFFERS, ENTRIES
from photogonio.calib.rig.pooling import CONTRADICTS


def test_a_set_that_differs_has_a_code_that_says_by_how_little_chance():
    (entry,) = ENTRIES
    assert entry.code == DIFFERS
    assert f"{CONTRADICTS:g}" in entry.means
