"""Places by their angles."""

import pytest

from photogonio.reconstruct.design.spots import Piece, Spot, apart, flash_shot


def test_spots_and_places_are_inverse():
    again = Spot.of(Spot(35.0, -120.0, 420.0).place)
    assert (again.elevation, again.azimuth, again.distance) == pytest.approx((35.0, -120.0, 420.0))


def test_a_flash_is_beside_the_lens():
    shot = flash_shot(Spot(50.0, -90.0, 600.0))
    assert shot.flash and 0.5 < apart(shot.camera, shot.lamp) < 3.0


def test_a_flash_sees_what_lies_about_its_own_direction():
    pairs = Piece(True, (25.0, 25.0)).pairs(flash_shot(Spot(50.0, -90.0, 600.0)))
    assert abs(pairs.theta_i - pairs.theta_r).max() < 0.05
