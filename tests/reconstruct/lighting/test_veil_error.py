"""What is not known of light over whole photos, relative to what was measured."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.lighting.veil_error import veil_error
from tests.reconstruct.lighting.test_stray_limits import (
    ALBEDO,
    LIGHTS,
    RADIUS,
    SAMPLE,
    normals,
    setup_of,
    table_of,
)

ERROR, STRENGTH = 0.003, 2.0


def with_error(*views: int):
    setup = setup_of(strength=STRENGTH)
    own = [
        replace(view, veil=np.full(1, 0.01), veil_error=np.full(1, ERROR)) if k in views else view
        for k, view in enumerate(setup.views)
    ]
    return replace(setup, views=tuple(own))


def test_it_is_the_error_over_the_middle_radiance_of_the_sample():
    """Which of a matte ball is albedo / pi times the lamp's irradiance."""
    setup = with_error(0, 1, 2)
    every, share = normals(), []
    for light in LIGHTS:
        own = every[every @ light.toward(SAMPLE.center[None])[0][0] > 0.2]
        toward, falloff = light.toward(SAMPLE.center + RADIUS * own)
        radiance = ALBEDO / np.pi * STRENGTH * (toward * own).sum(1) * falloff
        share.append(ERROR / radiance)
    assert veil_error(table_of(setup), setup) == pytest.approx(np.median(np.concatenate(share)), rel=1e-9)


def test_photos_without_it_have_no_such_error():
    assert veil_error(table_of(with_error()), with_error()) == 0.0
    some, every = (veil_error(table_of(s), s) for s in (with_error(0), with_error(0, 1, 2)))
    assert some < every
