"""Terms of the adjustment: what shading, highlights and the manifest say, as residuals of the blocks."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.bearing import Bearing
from photogonio.calib.adjust.bundle import adjust, prior_term
from photogonio.calib.adjust.camera_model import CameraModel, block_pose
from photogonio.calib.adjust.lamps import Lamp
from photogonio.calib.adjust.terms import (
    _expectations,
    _lamp_expectations,
    _shared_lamp,
    all_terms,
    fixed_blocks,
    shading_term,
    sightings,
    tone_term,
)
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.observation import FIXED_POSE
from photogonio.calib.rig.gaussian import NOTHING
from photogonio.calib.shading.correction import NO_FALLOFF
from photogonio.calib.shading.parameters import BALL, LOCAL, SHARED
from photogonio.capture.photoset import CameraEntry, LightEntry
from tests.drawn.setups import BALLS, MIDDLE, SAMPLE, photoset_of

POLISHED = 2
COUNT = LOCAL + SHARED + BALL * POLISHED
OWN = slice(3, LOCAL)
NAMES = [
    ("sample", slice(0, 4)),
    ("lamp", slice(0, SHARED - 4)),
    ("ball 0", slice(0, 4)),
    ("ball 1", slice(0, 4)),
]


@pytest.fixture(scope="module")
def told():
    """A quadratic in all values of one view, and the blocks that it is about."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(3 * COUNT, COUNT))
    place = np.array([300.0, 20, 400])
    fit = SimpleNamespace(place=place, normal=root.T @ root, gradient=5 * rng.normal(size=COUNT))
    values = {name: rng.normal(size=part.stop) for name, part in NAMES}
    values |= {"light a": place.copy(), "pose s0": np.array([0.3, -0.2, 0.5, 10.0, 20.0, 300.0])}
    observation = SimpleNamespace(light="a", pose_block="pose s0", view=SimpleNamespace(name="s0"))
    return fit, values, observation


def lowest(fit, step: np.ndarray) -> float:
    """The quadratic, its own values where it is least, after a step (COUNT,) of all others."""
    others = np.r_[0:3, LOCAL:COUNT]
    step = step.copy()
    pull = fit.gradient[OWN] + fit.normal[OWN, others] @ step[others]
    step[OWN] = -np.linalg.solve(fit.normal[OWN, OWN], pull)
    return float(fit.gradient @ step + 0.5 * step @ fit.normal @ step)


def test_shading_says_of_what_is_shared_all_that_is_left_once_its_own_values_give_way(told):
    fit, values, observation = told
    term = shading_term(fit, observation, Lamp("a", None, "point", fit.place, "board"), values, MIDDLE)
    start = 0.5 * float(np.sum(term(values)[0] ** 2)) - lowest(fit, np.zeros(COUNT))
    rng = np.random.default_rng(2)
    for _ in range(5):
        step, moved = np.zeros(COUNT), {name: value.copy() for name, value in values.items()}
        step[:3], step[LOCAL:] = rng.normal(size=3), rng.normal(size=COUNT - LOCAL)
        moved["light a"] = Bearing(MIDDLE, fit.place).place(fit.place + step[:3])  # how it is seen
        place = LOCAL
        for name, part in NAMES:
            moved[name] += step[place : place + part.stop]
            place += part.stop
        residual = term(moved)[0]
        assert 0.5 * float(residual @ residual) - start == pytest.approx(lowest(fit, step), rel=1e-9)


def test_a_flash_is_told_in_the_cameras_frame(told):
    """Its block is a place in front of the camera: the same world place gives the same residuals."""
    fit, values, observation = told
    plain = shading_term(fit, observation, Lamp("a", None, "point", fit.place, "board"), values, MIDDLE)
    entry = LightEntry("a", attached_to="camera")
    flash = shading_term(fit, observation, Lamp("a", entry, "point", fit.place, "board"), values, MIDDLE)
    pose, place = block_pose(values["pose s0"]), np.array([290.0, 31, 420])
    one = plain(values | {"light a": place})[0]
    other = flash(values | {"light a": pose.apply(place)})[0]
    np.testing.assert_allclose(other, one, rtol=1e-9)


def test_every_highlight_of_a_known_lamp_is_a_sighting():
    spots = [Highlight(k, np.array([1.0, 2]), 0.1 * (k + 1), 1.0, 4.0, False) for k in (0, 1)]
    seen = [
        SimpleNamespace(light=light, pose_block=f"pose {k}", highlights=spots)
        for k, light in enumerate(("sun", "flash", "unknown"))
    ]
    lamps = {
        "sun": Lamp("sun", None, "directional", np.ones(3), "probe"),
        "flash": Lamp("flash", LightEntry("flash", attached_to="camera"), "point", np.ones(3), "board"),
    }
    found = sightings(seen, lamps, 2.0)
    assert [(s.pose, s.light, s.ball) for s in found] == [
        (f"pose {k}", f"light {name}", f"ball {n}") for k, name in enumerate(("sun", "flash")) for n in (0, 1)
    ]
    assert [s.directional for s in found] == [True, True, False, False] == [not s.attached for s in found]
    np.testing.assert_allclose([s.sigma for s in found], [0.2, 0.4, 0.2, 0.4])


def test_what_the_manifest_states_is_fixed(drawn):
    world, _ = drawn
    photoset = photoset_of(world, fixed=True)
    lamps = {n: Lamp(n, None, "point", np.ones(3), "given", fixed=n == "a") for n in "ab"}
    assert fixed_blocks(photoset, lamps) == {"light a"}
    given = CameraEntry(np.eye(3), rotation=np.eye(3), translation=np.zeros(3))
    assert fixed_blocks(replace(photoset, camera=given), {}) == {"camera", FIXED_POSE}


def test_without_photos_balls_and_sample_are_where_the_manifest_has_them(drawn):
    """As surely as it is taken to: 2 % of a mirror ball's radius, 3 % of the sample's; that stands on the paper."""
    world, _ = drawn
    photoset = photoset_of(world, fixed=True)
    values = {f"ball {k}": np.append(b.center, b.radius) + 0.3 for k, b in enumerate(BALLS)}
    values |= {"sample": np.append(SAMPLE.center, SAMPLE.radius) + 0.3, "limb offset": np.ones(1)}
    done = adjust(values, _expectations(photoset, values, NOTHING))
    np.testing.assert_allclose(done.values["sample"], np.append(SAMPLE.center, SAMPLE.radius), atol=1e-6)
    np.testing.assert_allclose(done.values["ball 1"], np.append(BALLS[1].center, BALLS[1].radius), atol=1e-6)
    np.testing.assert_allclose(done.values["limb offset"], 0.0, atol=1e-9)
    errors = np.sqrt(np.diag(done.covariance["sample"])) / SAMPLE.radius
    np.testing.assert_allclose(errors[:2], 0.03, rtol=1e-6)
    assert errors[2] < 0.006  # its height is its radius, and that is better known
    np.testing.assert_allclose(
        np.sqrt(np.diag(done.covariance["ball 0"]))[:3], 0.02 * BALLS[0].radius, rtol=0.01
    )


@pytest.mark.parametrize("beam", [False, True])
def test_a_lamps_beam_is_held_unless_it_is_known(beam):
    values = {"lamp": np.array([1.0, -3.0, 0.4, 0.0, 0.0]), "light a": np.array([0, 0, 400.0])}
    lonely = Lamp("a", None, "point", values["light a"], "probe", one_ray=True)
    terms = expected_of_lamps({"a": lonely}, values, beam)
    done = adjust(values, terms)
    assert abs(done.values["lamp"][2]) < 1e-6
    spread = np.sqrt(np.diag(done.covariance["lamp"]))
    np.testing.assert_allclose(spread, [0.7, 0.3, 1.5 if beam else 0.02, 0.002, 0.002], rtol=1e-6)
    np.testing.assert_allclose(np.sqrt(np.diag(done.covariance["light a"])), 0.3 * 400, rtol=1e-6)
    held = Lamp("a", None, "point", values["light a"], "given", fixed=True)
    assert len(expected_of_lamps({"a": held}, values, beam)) == 1


def expected_of_lamps(lamps, values, beam):
    state = SimpleNamespace(rig=NOTHING, narrow=1.0 if beam else 0.0, falloff=NO_FALLOFF)
    return _shared_lamp(state, values) + _lamp_expectations(lamps, values, NOTHING)


FLASH = LightEntry(id="flash", kind="point", attached_to="camera")


def flash_by(sigma: float, place: np.ndarray, unit: float = 1.0) -> np.ndarray:
    """Where a flash on the camera comes to rest that other things show at ``place`` within ``sigma``; ``unit``: one
    millimetre."""
    lamps = {"flash": Lamp("flash", FLASH, "point", place, "board")}
    values = {"light flash": place.copy()}
    told = prior_term("light flash", place, np.full(3, sigma))
    return adjust(values, [*_lamp_expectations(lamps, values, NOTHING, unit), (told, False)]).values[
        "light flash"
    ]


def test_a_flash_is_expected_beside_the_lens_unless_it_surely_is_not():
    near = flash_by(15.0, np.array([10.0, -5.0, 30.0]))
    assert abs(near[2]) < 10 and np.abs(near[:2]) == pytest.approx([10, 5], abs=5)
    far = np.array([150.0, 0.0, 0.0])  # on a camera's shoe
    assert flash_by(5.0, far) == pytest.approx(far, abs=5.0)


@pytest.mark.parametrize("unit", [0.1, 0.001, 1 / 25.4, 1000.0])
def test_where_a_flash_is_expected_does_not_hang_on_the_unit_of_length(unit):
    for place in (np.array([10.0, -5.0, 30.0]), np.array([150.0, 0.0, 0.0])):
        assert flash_by(15.0 * unit, place * unit, unit) / unit == pytest.approx(
            flash_by(15.0, place), abs=1e-4
        )


def test_a_sets_unit_reaches_what_is_expected_of_its_lamps(drawn):
    """The same set told in centimetres expects the same."""
    world, _ = drawn
    lamps = {"flash": Lamp("flash", FLASH, "point", np.ones(3), "board")}
    model, squares = CameraModel((640, 480), np.zeros(5), ()), []
    for name, unit in (("mm", 1.0), ("cm", 0.1)):
        photoset = replace(photoset_of(world, fixed=True), length_unit=name, mirror_balls=())
        common = {"tone": None, "rig": NOTHING, "narrow": 0.0, "falloff": NO_FALLOFF}
        state = SimpleNamespace(photoset=photoset, model=model, boards=[], **common)
        values = {
            "light flash": unit * np.array([10.0, -5.0, 3.0]),
            "camera": np.array([700.0, 700.0, 320.0, 240.0]),
        }
        residual = all_terms(state, [], lamps, values, {}, 1.0)[-1][0](values)[0]
        squares.append(float(residual @ residual))
    assert squares[1] == pytest.approx(squares[0])


def test_what_print_told_of_lamps_holds_those_that_are_sought():
    place = np.array([100.0, 50.0, 300.0])
    spread = np.diag([4.0, 9.0, 25.0])
    tone = SimpleNamespace(
        lamps=("a", "gone"), places=np.stack([place, place]), covariance=np.kron(np.eye(2), spread)
    )
    lamps = {"a": Lamp("a", None, "point", place, "board")}
    residual, slopes = tone_term(tone, lamps)({"light a": place + np.array([2.0, 3.0, 5.0])})
    assert residual @ residual == pytest.approx(3.0)
    assert slopes["light a"].T @ slopes["light a"] == pytest.approx(np.linalg.inv(spread))
    given = {"a": replace(lamps["a"], fixed=True)}
    assert tone_term(tone, given) is None
