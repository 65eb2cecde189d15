"""What is not known of a lens that darkens its pictures, in the errors that are stated of lamps' strengths."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from photogonio.calib.adjust.state import State
from photogonio.calib.diagnose.base import NO_DOUBT
from photogonio.calib.diagnose.lights.vignetting import (
    Vignetting,
    _unknown,
    corrected,
    falloff_known,
    lens_doubt,
)
from photogonio.calib.diagnose.procedure import settle_allowing, tell_lights
from photogonio.calib.diagnose.registry import LIGHT
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.setup import Falloff, Light, ViewSetup
from photogonio.calib.shading.kernel import lens
from photogonio.calib.views import light_of
from photogonio.capture.photoset import PhotoSet, Sphere, WhitePatch
from tests.drawn.boards import looking_at
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import (
    BLACK,
    PAPER,
)

CAMERA = Camera(
    np.array([[1150.0, 0, 400], [0, 1150, 300], [0, 0, 1]]), np.array([-0.1, 0.05, 0, 0, 0]), (800, 600)
)
SAMPLE = Sphere(np.array([90.0, 70, 25]), 25.0)
POSES = [
    looking_at(np.array([90.0, 70 - y, z]), np.array([90.0, 70, 10])) for y, z in ((20, 300), (230, 140))
]
FALLOFF = Falloff(np.array([-0.2, 0.0]), np.diag([0.05**2, 0.0]), allowed=True)
ERROR = 0.003  # of the strengths' own


def sheet(x: float, y: float) -> WhitePatch:
    return WhitePatch(np.array([[x, y], [x + 10, y], [x + 10, y + 10], [x, y + 10]]), 0.3, (0.9,))


SEEN, OUTSIDE, BEHIND = sheet(130, 60), sheet(250, 10), sheet(90, -200)


def found(*sheets: WhitePatch) -> tuple[np.ndarray, float]:
    """The views' errors (v,) and the one that they share."""
    lamp = Light("a", "point", np.array([0.0, 0, 500]), np.eye(3), "board", 3.0, 0.1)
    views = [
        ViewSetup(f"v{k}", lamp, pose, np.ones(1), np.full(1, ERROR), "white patch", 0.1, None, None)
        for k, pose in enumerate(POSES)
    ]
    photoset = PhotoSet(Path("."), "x", "mm", SAMPLE, "auto", (), None, (), sheets)
    doubt = lens_doubt(photoset, CAMERA, views, FALLOFF)
    own = np.hypot(ERROR, np.broadcast_to(doubt.own, len(views)))
    return own, doubt.common


def test_a_doubtful_falloff_makes_strengths_doubtful_by_how_far_apart_patch_and_sample_are_in_the_picture():
    """In the mean of the photos, which all of them share, and what one differs from it."""
    own, common = found(SEEN)
    apart = []
    for pose in POSES:
        sample, patch = CAMERA.project(pose, np.array([SAMPLE.center, [135.0, 65, 0.3]])) - [400, 300]
        apart.append(
            (sample @ sample - patch @ patch) / (400**2 + 300**2)
        )  # (399, 299): the other corner is nearer
    assert common == pytest.approx(0.05 * abs(np.mean(apart)), rel=1e-6)
    np.testing.assert_allclose(own, np.hypot(ERROR, 0.05 * (apart - np.mean(apart))), rtol=1e-6)


@pytest.mark.parametrize("more", [OUTSIDE, BEHIND])
def test_patches_that_a_photo_does_not_show_tell_nothing_of_its_doubt(more):
    own, common = found(SEEN)
    with_it, shared = found(SEEN, more)
    np.testing.assert_array_equal(with_it, own)
    assert shared == common
    np.testing.assert_array_equal(found(more)[0], ERROR)


def test_no_falloff_that_any_photo_tells_of_is_no_doubt():
    assert lens_doubt(None, None, [object()], None) is NO_DOUBT


def dimmed(drawn: Drawn, corner: float) -> State:
    """Paper, lamps and balls of all photos, through a lens that leaves ``1 + corner`` of the light in the corners."""
    state = drawn.watched(paper=True)
    for observation in state.observations:
        lens = 1 + corner * observation.reading.samples.aside
        samples = replace(
            observation.reading.samples, value=observation.reading.samples.value * lens[:, None]
        )
        observation.reading = replace(
            observation.reading, samples=samples, level=observation.reading.level * lens
        )
    return state


@pytest.mark.parametrize(
    ("fixed", "corner"),
    [
        (True, 0.0),
        (False, -0.12),
        (True, -0.4),
        pytest.param(False, 0.0, marks=pytest.mark.long),  # held by a rendered set before a moving camera
        pytest.param(True, -0.12, marks=pytest.mark.long),
        pytest.param(False, -0.4, marks=pytest.mark.long),
    ],
)
def test_a_lens_that_darkens_the_corners_is_told(fixed, corner):
    """The same in all photos, each under its own lamp: falloff of the lamp alone would have it stand elsewhere, against
    its shadows, and otherwise in every photo."""
    drawn = Drawn(4, fixed=fixed)
    state = settle_allowing(dimmed(drawn, corner), LIGHT)
    settled, observations, found = state.settled, state.observations, falloff_known(state)
    assert state.found["vignetting"].allowed == found.allowed == (corner < 0)
    assert not state.found["lamp-beam"].told
    aside = np.linspace(0.05, max(s.reading.samples.aside.max() for s in observations), 20)
    both = np.column_stack([aside, aside**2])
    error = np.sqrt(np.einsum("ni,ij,nj->n", both, found.covariance, both))
    # of the paper of each photo 0.2 % and more is uneven, which no number of its places lessens
    assert error.max() < 0.02
    assert (np.abs(both @ found.terms - np.log(1 + corner * aside)) < 4 * error + 0.002).all()
    lights = [(light_of(settled, s), drawn.world.lamps[int(s.view.name[1:])]) for s in observations]
    off = [(light.place - lamp, light.covariance) for light, lamp in lights]
    assert np.median([d @ np.linalg.solve(cov, d) / 3 for d, cov in off]) < 4  # squares of standard errors
    before = observations[0].reading.level
    after = corrected(state).observations[0].reading
    left = lens(after.samples.aside, found.terms) if corner < 0 else 1.0
    np.testing.assert_allclose(after.level * left, before, rtol=1e-12)
    tell_lights(state, [Vignetting()])
    assert drawn.told("vignetting") == (corner < 0)
    assert drawn.remarks.residuals["lens_falloff"]["allowed_for"] == (corner < 0)


def test_a_lens_is_found_in_a_lit_room_which_passed_for_a_beam():
    """Of the room's light, 0.1 of the lamp's, lamps that shine less aside explain a part: known, it is found again."""
    drawn = Drawn(27, views=4)
    state = drawn.watched(paper=True)
    for observation in state.observations:
        reading, samples = observation.reading, observation.reading.samples
        room = 0.1 * np.median(reading.level[samples.white]) * np.where(samples.white, 1.0, BLACK / PAPER)
        level = (reading.level + room) * (1 - 0.12 * samples.aside)
        value = samples.value * (level / reading.level)[:, None]
        observation.reading = replace(reading, level=level, samples=replace(samples, value=value))
    state = settle_allowing(state, LIGHT)
    settled, observations, falloff = state.settled, state.observations, falloff_known(state)
    assert state.found["ambient-light"].told
    assert falloff.allowed and not state.found["lamp-beam"].told
    darker, error = falloff.corner
    assert abs(darker + 0.12) < 4 * error
    off = [
        np.linalg.norm(light_of(settled, s).place - drawn.world.lamps[int(s.view.name[1:])])
        for s in observations
    ]
    assert np.median(off) < 0.015 * 400


@pytest.mark.parametrize("error", [0.003, 0.01, 0.03])
def test_what_is_not_allowed_for_is_doubted_by_as_much_as_it_is_in_the_mean(error):
    """Half of all lenses darken by 0.02 rms, half not at all; what photos tell of the terms is off by ``error``."""
    rng = np.random.default_rng(5)
    known = error**2 * np.array([[1.0, -0.9], [-0.9, 1.0]])
    true = 0.02 * rng.normal(size=(4000, 2)) * (rng.random((4000, 1)) < 0.5)
    told = true + rng.multivariate_normal([0.0, 0.0], known, 4000)
    stated = np.mean([_unknown(Falloff(terms, known)) for terms in told], axis=0)
    # 4000 lenses know a mean square to 4 % (half of them are 0)
    np.testing.assert_allclose(np.diag(stated), np.mean(true**2, axis=0), rtol=0.12)
