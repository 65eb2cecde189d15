"""Places of values in a row: each value has one, and none is left over."""

import numpy as np

from photogonio.calib.shading import parameters
from photogonio.calib.shading.model import Ball, ShadingScene

PLACE, STRENGTH = range(3), 3


def test_a_views_own_values_have_one_place_each():
    tilts = range(parameters.LOCAL)[parameters.TILTS]
    every = [*PLACE, STRENGTH, parameters.EVEN, *tilts, *parameters.THROWN, parameters.PATCHES]
    assert sorted(every) == list(range(parameters.LOCAL))


def test_shared_values_stand_where_the_scene_puts_them():
    """Each of a scene's own values, changed alone, moves the one number that is named after it."""
    scene = ShadingScene((Ball(np.ones(3), 2.0),), Ball(np.zeros(3), 1.0), 3.0, 0.05, 0.0)
    own = np.concatenate([np.zeros(parameters.LOCAL), scene.shared])
    assert len(scene.shared) == parameters.SHARED + parameters.BALL
    for place, change in (
        (parameters.BLACK, {"black": 0.1}),
        (parameters.NARROW, {"narrow": 1.5}),
        (parameters.FALLOFF, {"falloff": (-0.2, 0.0)}),
        (parameters.FALLOFF + 1, {"falloff": (0.0, -0.2)}),
    ):
        fields = {name: getattr(scene, name) for name in scene.__slots__} | change
        moved = np.concatenate([np.zeros(parameters.LOCAL), ShadingScene(**fields).shared])
        assert np.flatnonzero(moved != own).tolist() == [place]
