"""Photos are chosen by what they lower."""

from itertools import pairwise

import pytest

from photogonio.reconstruct.design.materials import of_material
from photogonio.reconstruct.design.places import Feasible, best_photos, candidates
from photogonio.reconstruct.design.spots import Piece, Spot, Stance, apart

FLAT = Piece(False, (35.0, 28.0))
BALL = Piece(True, (25.0, 25.0))


def stance(camera, lamp):
    return Stance(Spot(*camera, 600.0), Spot(*lamp, 400.0))


@pytest.mark.parametrize("piece", [FLAT, BALL], ids=["flat", "ball"])
def test_chosen_photos_lower_the_variance_more_than_any_other_first(piece):
    belief = of_material("satin").seen(piece.pairs(stance((60, -90), (45, 60))))
    stances = candidates(Feasible(600.0, 400.0), piece, turning=False)[::17]
    steps = best_photos(belief, stances, piece.pairs, 3)
    every = [belief.seen(piece.pairs(one)).mean_variance() for one in stances]
    assert steps[0].before == pytest.approx(belief.mean_variance(), rel=1e-9)
    assert steps[0].after == pytest.approx(min(every), rel=1e-6)
    assert all(a.after == b.before and a.after <= a.before for a, b in pairwise(steps))
    assert all(one.flash or apart(one.camera, one.lamp) >= 6.0 for one in stances)


def test_a_camera_that_stays_is_left_where_it_is():
    still = Spot(40.0, -90.0, 500.0)
    found = candidates(Feasible(600.0, 400.0, camera=still), FLAT, turning=True)
    assert {one.camera for one in found} == {still}
    flash = candidates(Feasible(600.0, 400.0, lamps="flash"), FLAT, turning=False)
    assert flash and all(one.flash for one in flash)
    assert not any(one.flash for one in candidates(Feasible(600.0, 400.0, lamps="lamp"), FLAT, turning=False))
