"""The lamp's strength comes back from a drawn white patch; patches that lie are not believed; paper is tied."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_reading import PaperReading as Paper
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.radiometry.patch import UNEVEN, NoStrength, Stray, Strength, read_paper, read_patch
from photogonio.calib.radiometry.readings import StrengthReadings, _mean, aimed, read_view
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks
from photogonio.calib.setup import Light
from photogonio.calib.shading.model import Ball, ShadingScene
from photogonio.capture.photoset import PhotoSet, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage
from tests.drawn.boards import looking_at, plane_points, radiance
from tests.drawn.setups import BOARD

SIZE = (320, 240)
CAMERA = Camera(
    np.array([[500.0, 0, 158.0], [0, 505.0, 121.0], [0, 0, 1]]),
    np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
    SIZE,
)
HEIGHT = 1.5
PATCH = WhitePatch(np.array([[-30.0, -25], [30, -25], [30, 25], [-30, 25]]), HEIGHT, (0.9, 0.8, 0.7))
POSE = looking_at(np.array([40.0, -120, 150]), np.array([0.0, 0, HEIGHT]))
STRENGTH = np.array([3e4, 2e4, 1e4])
NEAR = Light("near", "point", np.array([60.0, 35, 90]), np.zeros((3, 3)), "given")
FAR = Light("far", "directional", np.array([0.48, 0.36, 0.8]), np.zeros((3, 3)), "given")
NOISE = 0.002


def lit_by(light: Light, height: float = HEIGHT) -> np.ndarray:
    """Irradiance (h, w) for unit strength where each pixel meets the plane, from the definition."""
    x, y = plane_points(CAMERA, POSE, height)
    if light.kind == "directional":
        return np.full(x.shape[1:], light.place[2])
    offset = light.place - np.stack([x, y, np.full_like(x, height)], axis=-1)
    return (offset[..., 2] / np.linalg.norm(offset, axis=-1) ** 3).mean(0)


def photo(light: Light) -> RadianceImage:
    """The patch's plane, Lambert, filling the picture, with one part in 500 of noise."""
    shape = lit_by(light)[..., None] * STRENGTH * np.array(PATCH.reflectance) / np.pi
    noise = NOISE * shape.mean(axis=(0, 1))
    value = shape + noise * np.random.default_rng(3).normal(size=shape.shape)
    blank = radiance(shape[..., 0], 0.0, 3)
    variance = np.broadcast_to(noise**2, shape.shape).astype(np.float32)
    return replace(blank, value=value.astype(np.float32), variance=variance)


def read(image: RadianceImage, light: Light, stray: Stray | None = None) -> Strength:
    return read_patch(image, CAMERA, POSE, light, PATCH, stray)


@pytest.mark.parametrize("light", [NEAR, FAR], ids=["near", "far"])
def test_strength_comes_back_from_a_patch(light):
    found = read(photo(light), light)
    assert found.value is not None, found.problem
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi
    # thousands of pixels with 0.2 % to 0.5 % of noise each: their median is sure to a few parts in ten thousand
    np.testing.assert_allclose(found.value, expected, rtol=5e-4)
    assert (np.abs(found.value - expected) < 2 * found.error).all()


def test_strength_is_what_a_narrow_lamp_sends_along_its_axis():
    """A lamp that points beside the patch lights it less, by the cosine squared at each pixel."""
    aim, power = np.array([40.0, 60.0, 0.0]), 2.0
    x, y = plane_points(CAMERA, POSE, HEIGHT)
    ray, axis = np.stack([x, y, np.full_like(x, HEIGHT)], axis=-1) - NEAR.place, aim - NEAR.place
    cosine = (ray @ axis / np.linalg.norm(ray, axis=-1) / np.linalg.norm(axis)).mean(0)
    image = photo(NEAR)
    dimmed = replace(image, value=(image.value * cosine[..., None] ** power).astype(np.float32))
    stray = Stray(ShadingScene((), None, 1.0, 0.05, 0.0, narrow=power, aim=tuple(aim)), np.zeros(3), 0.0)
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi
    np.testing.assert_allclose(read(dimmed, NEAR, stray).value, expected, rtol=5e-4)
    ignored = read(dimmed, NEAR)
    assert ignored.value is None or (ignored.value < 0.95 * expected).all()


def test_strength_is_that_toward_the_sample_of_a_lamp_that_points_beside_it():
    """A beam whose axis passes the sample by 6 degrees: over the board its light is that of one aimed at the sample,
    but tilted. At the patch, 34 degrees from the sample, what is linear in both angles changes it by the power times
    the product of their tangents, 0.41; what is not, by half the square of that."""
    aim, beside, power = np.array([60.0, -25.0, HEIGHT]), np.array([60.0, -13.0, HEIGHT]), 6.0

    def beam(points, at):
        ray, axis = points - NEAR.place, at - NEAR.place
        return (ray @ axis / np.linalg.norm(ray, axis=-1) / np.linalg.norm(axis)) ** power

    step = 0.1 * np.eye(3)[:2]
    slope = np.array([np.log(beam(aim + s, beside) / beam(aim - s, beside)).item() for s in step]) / 0.2
    x, y = plane_points(CAMERA, POSE, HEIGHT)
    image = photo(NEAR)
    points = np.stack([x, y, np.full_like(x, HEIGHT)], axis=-1)
    dimmed = replace(image, value=(image.value * beam(points, beside).mean(0)[..., None]).astype(np.float32))
    scene = ShadingScene((), None, 1.0, 0.05, 0.0, narrow=power, aim=tuple(aim))
    low, high = np.array([-90.0, -70.0]), np.array([90.0, 70.0])
    paper, tilts = SimpleNamespace(span=(low, high)), slope * (high - low) / 2
    tilt = aimed(scene, paper, tilts)
    assert tilt[0] + np.dot(tilt[1:], aim[:2]) == pytest.approx(1.0)
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi * beam(aim, beside)
    found = read(dimmed, NEAR, Stray(scene, np.zeros(3), 0.0, tilt))
    change = power * np.tan(np.radians(5.7)) * np.tan(np.radians(34.3))
    np.testing.assert_allclose(found.value, expected, rtol=change**2 / 2)
    plain = read(dimmed, NEAR, Stray(scene, np.zeros(3), 0.0))
    assert plain.value is None and (np.abs(plain.rough.value / expected - 1) > change**2 / 2).all()
    assert aimed(replace(scene, narrow=0.0), paper, tilts) == (1.0, 0.0, 0.0)


def test_the_light_across_the_patch_is_uneven_enough_to_need_falloff_and_angle():
    image = photo(NEAR)
    wrong = replace(NEAR, place=NEAR.place + np.array([0.0, 0, 30.0]))
    truth, off = read(image, NEAR), read(image, wrong)
    assert truth.value is not None
    assert off.value is None or np.abs(off.value / truth.value - 1).min() > 0.1


def test_the_pull_is_how_the_reading_turns_with_the_lamps_place():
    image, step = photo(NEAR), 0.05
    pull = read(image, NEAR).pull
    slopes = []
    for axis in np.eye(3):
        there, back = (read(image, replace(NEAR, place=NEAR.place + s * step * axis)) for s in (1, -1))
        slopes.append(-np.log(there.value / back.value).mean() / (2 * step))
    # the median's slope is that of the middle of the patch; the mean's differs by its curvature, percents
    np.testing.assert_allclose(slopes, pull, atol=0.05 * np.linalg.norm(pull))
    np.testing.assert_array_equal(read(photo(FAR), FAR).pull, 0.0)


def test_a_clipped_patch_is_not_believed():
    image = photo(NEAR)
    level = image.value[..., 0]
    saturated = level > np.quantile(level, 0.7)
    found = read(replace(image, saturated=saturated, valid=~saturated), NEAR)
    assert found.value is None
    assert "clipped" in found.problem


def test_a_patch_in_a_soft_shadow_is_not_believed():
    image = photo(NEAR)
    across = np.linspace(0.2, 1.0, SIZE[0])[None, :, None]
    found = read(replace(image, value=(image.value * across).astype(np.float32)), NEAR)
    assert found.value is None
    assert "uneven" in found.problem


def test_what_an_uneven_patch_tells_is_not_lost_beside_one_that_is_not_in_the_picture():
    away, image = replace(PATCH, outline=PATCH.outline + 400.0), photo(NEAR)
    image = replace(
        image, value=(image.value * np.linspace(0.2, 1.0, SIZE[0])[None, :, None]).astype(np.float32)
    )
    settled, observation = (
        SimpleNamespace(camera=CAMERA, scene=None),
        SimpleNamespace(pose=POSE, reading=None),
    )
    one, *more = (
        read_view(replace(SET, white_patches=sheets), image, settled, observation, NEAR).patch
        for sheets in ((PATCH,), (PATCH, away), (away, PATCH))
    )
    assert one.problem == UNEVEN
    for found in more:
        assert found.problem == UNEVEN
        np.testing.assert_array_equal(found.rough.value, one.rough.value)


@pytest.mark.parametrize("share", [0.1, 0.35, 0.6, 0.9])
@pytest.mark.parametrize("tone", [0.0, 0.3, 0.85])
def test_a_hard_shadow_does_not_lower_the_strength_however_much_it_covers(share, tone):
    """Also what hides a part of the patch, where it is darker."""
    image = photo(NEAR)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    seen = CAMERA.project(POSE, np.column_stack([PATCH.outline, np.full(4, HEIGHT)]))
    low, high = seen[:, 0].min(), seen[:, 0].max()
    edge = np.clip((x + 0.1 * y - low - share * (high - low)) / 2, 0, 1)  # soft over two pixels
    value = image.value * (tone + (1 - tone) * edge)[..., None]
    found = read(replace(image, value=value.astype(np.float32)), NEAR)
    assert found.value is not None, found.problem
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi
    # hundreds of pixels are left: their median is sure to a part in two thousand
    np.testing.assert_allclose(found.value, expected, rtol=2e-3)
    assert (np.abs(found.value - expected) < 2 * found.error).all()


def test_blemishes_and_an_even_gradient_are_no_shadow():
    image = photo(NEAR)
    value = image.value.copy()
    value[::11, ::13] *= 0.5
    clean = read(image, NEAR)
    np.testing.assert_allclose(read(replace(image, value=value), NEAR).value, clean.value, rtol=1e-3)
    across = np.linspace(0.97, 1.03, SIZE[0])[None, :, None]
    tilted = read(replace(image, value=(image.value * across).astype(np.float32)), NEAR)
    np.testing.assert_allclose(tilted.value, clean.value, rtol=0.01)


@pytest.mark.parametrize("gain", [1.15, 1.4])
def test_bright_specks_all_over_make_no_shadow_of_the_rest(gain):
    """A rough metal ball throws them: what is beside every speck is not dark, though it is darker."""
    image = photo(NEAR)
    specks = np.random.default_rng(4).random(SIZE[::-1]) < 0.05
    thrown = replace(image, value=(image.value * np.where(specks, gain, 1.0)[..., None]).astype(np.float32))
    found, clean = read(thrown, NEAR), read(image, NEAR)
    assert found.value is not None, found.problem
    # of ten thousand pixels a twentieth is gone: the median moves by a part of its own error
    assert (np.abs(found.value - clean.value) < clean.error).all()


def test_of_two_patches_the_one_in_shadow_is_not_believed():
    lit, dark = strength(STRENGTH), strength(0.6 * STRENGTH)
    found = _mean([dark, lit])
    np.testing.assert_allclose(found.value, STRENGTH)
    assert "darker" in found.problem
    assert _mean([lit, strength(1.004 * STRENGTH)]).problem == ""


def test_a_patch_in_the_samples_shadow_is_not_read():
    foot = np.array([0.0, 0, HEIGHT])
    ball = Ball(foot + 0.6 * (NEAR.place - foot), 30.0)
    stray = Stray(ShadingScene((), ball, 1.0, 0.05, 0.1), np.zeros(3), 0.0)
    found = read(photo(NEAR), NEAR, stray)
    assert found.value is None
    assert "shadow" in found.problem


def test_a_patch_outside_the_picture_or_black_is_not_read():
    away = replace(PATCH, outline=PATCH.outline + 400.0)
    assert read_patch(photo(NEAR), CAMERA, POSE, NEAR, away, None).value is None
    image = photo(NEAR)
    assert "black" in read(replace(image, value=np.zeros_like(image.value)), NEAR).problem


def test_a_lamp_below_the_patch_lights_nothing():
    assert read(photo(NEAR), replace(NEAR, place=np.array([10.0, 0, -50]))).value is None


def paper(light: Light, white: float, black: float) -> Paper:
    """Paper on the board's plane with the light's own irradiance."""
    x, y = np.meshgrid(np.linspace(-60, 60, 40), np.linspace(-60, 60, 40))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    toward, falloff = light.toward(points)
    square = (points[:, 0] // 12 + 11 * (points[:, 1] // 12)).astype(int)
    pale = square % 2 == 0
    value = (toward[:, 2] * falloff * np.where(pale, white, black))[:, None] * STRENGTH / np.pi
    return Paper(PaperSamples(points, pale, value, (0.01 * value) ** 2, square), value.mean(1), value[:, 0])


@pytest.mark.parametrize("light", [NEAR, FAR], ids=["near", "far"])
def test_paper_and_print_tell_strength_times_reflectance(light):
    reading = paper(light, 0.85, 0.05)
    np.testing.assert_allclose(read_paper(reading, light, None).value, 0.85 * STRENGTH / np.pi, rtol=1e-6)
    dark = read_paper(reading, light, None, white=False)
    np.testing.assert_allclose(dark.value, 0.05 * STRENGTH / np.pi, rtol=1e-6)


PAPER = np.array([0.85, 0.84, 0.8]) / np.pi
SET = PhotoSet(
    Path("."), "drawn", "mm", Sphere(np.array([0, 0, 20.0]), 20.0), "auto", (), white_patches=(PATCH,)
)


def strength(value: np.ndarray) -> Strength:
    return Strength(value, 0.003 * value, np.zeros(3))


def told(strengths: dict[str, np.ndarray]) -> dict[str, StrengthReadings]:
    return {
        n: StrengthReadings(strength(s), strength(s * PAPER), strength(0.05 * s * PAPER))
        for n, s in strengths.items()
    }


def tied(readings: dict[str, StrengthReadings], photoset: PhotoSet = SET):
    remarks = Remarks()
    lights = dict.fromkeys(readings, FAR)
    given = dict.fromkeys(readings, np.ones(3))
    values, scale = tie(photoset, readings, lights, given, remarks)
    return values, scale, remarks


STRENGTHS = {f"{k}.png": STRENGTH * (1 + 0.4 * k) for k in range(6)}


def test_paper_stands_in_for_a_patch_that_is_clipped():
    readings = told(STRENGTHS)
    readings["3.png"] = replace(readings["3.png"], patch=NoStrength("the patch is clipped"))
    values, scale, remarks = tied(readings)
    assert scale == "absolute"
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
    assert values["3.png"].source == "board"
    assert values["2.png"].source == "white patch"
    assert values["3.png"].error.min() > 0
    np.testing.assert_allclose(remarks.residuals["paper_reflectance"], PAPER * np.pi, rtol=1e-9)


def test_black_print_stands_in_where_the_paper_is_clipped_too():
    readings = told(STRENGTHS)
    readings["3.png"] = replace(
        readings["3.png"], patch=NoStrength("the patch is clipped"), paper=NoStrength("too little")
    )
    values, _, _ = tied(readings)
    np.testing.assert_allclose(values["3.png"].value, STRENGTHS["3.png"], rtol=1e-9)


def test_a_patch_that_contradicts_the_paper_is_not_believed():
    readings = told(STRENGTHS)
    readings["1.png"] = replace(readings["1.png"], patch=strength(0.8 * STRENGTHS["1.png"]))
    values, _, remarks = tied(readings)
    np.testing.assert_allclose(values["1.png"].value, STRENGTHS["1.png"], rtol=1e-9)
    assert any(w.startswith("1.png") and "not believed" in w for w in remarks.warnings)


@pytest.mark.parametrize(
    ("lost", "gained", "blamed"), [(0.12, 0.01, "paper"), (0.12, 0.0, "patch"), (0.01, 0.04, "")]
)
def test_where_white_has_spread_over_black_it_is_the_paper_that_is_not_believed(lost, gained, blamed):
    """White is darker and black lighter, as out of focus; black as it was, it is the patch that is too bright."""
    readings, true = told(STRENGTHS), STRENGTHS["1.png"]
    paper = (1 - lost) * true * PAPER
    readings["1.png"] = replace(
        readings["1.png"], paper=strength(paper), black=strength((0.05 + gained) * paper)
    )
    values, _, remarks = tied(readings)
    said = [w for w in remarks.warnings if w.startswith("1.png") and "not believed" in w]
    assert len(said) == (blamed != "")
    assert all(f"{blamed} is not believed" in w for w in said)
    if blamed == "paper":
        np.testing.assert_allclose(values["1.png"].value, true, rtol=1e-9)
        assert values["1.png"].source == "white patch"
    if blamed == "patch":
        np.testing.assert_allclose(values["1.png"].value, (1 - lost) * true, rtol=1e-9)


def test_of_three_patches_the_darker_ones_are_not_believed():
    """Too few to outvote: shadows only darken."""
    readings = told(dict(list(STRENGTHS.items())[:3]))
    for name in ("0.png", "2.png"):
        readings[name] = replace(readings[name], patch=strength(0.85 * STRENGTHS[name]))
    values, _, remarks = tied(readings)
    for name in readings:
        np.testing.assert_allclose(values[name].value, STRENGTHS[name], rtol=1e-9)
    assert remarks.codes().count("patch-not-believed") == 2


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_photos_that_are_not_linear_as_told_show_in_patch_and_paper(gamma):
    """A lamp lights the patch more or less than the paper, as it stands; codes of a power of the light, taken for
    light and divided by what the geometry expects, keep that in their ratio."""
    readings = told(STRENGTHS)
    for name, aside in zip(STRENGTHS, (0.7, 0.8, 0.9, 1.1, 1.2, 1.4), strict=True):
        patch = STRENGTHS[name] * aside ** (1.0 / gamma - 1.0)
        readings[name] = replace(readings[name], patch=strength(patch))
    _, _, remarks = tied(readings)
    assert ("patch-and-paper-scatter" in remarks.codes()) == (gamma != 1.0)


def test_patches_that_contradict_one_another_in_all_photos_are_told():
    readings = told(STRENGTHS)
    alike = {n: replace(r, patch=_mean([r.patch, r.patch])) for n, r in readings.items()}
    wrong = {
        n: replace(r, patch=_mean([r.patch, strength(0.7 * r.patch.value)])) for n, r in readings.items()
    }
    assert not tied(alike)[2].warnings
    values, _, remarks = tied(wrong)
    assert any("contradict one another" in w for w in remarks.warnings)
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)


def test_a_patch_that_makes_the_paper_whiter_than_white_lies_in_shadow():
    readings = told(STRENGTHS)
    for name in list(readings)[:4]:  # most of them: a median would believe these
        readings[name] = replace(readings[name], patch=strength(0.5 * STRENGTHS[name]))
    values, scale, remarks = tied(readings)
    assert scale == "absolute"
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
    assert sum("shadow" in w for w in remarks.warnings) == 4


def test_clipped_patches_are_named():
    readings = told(STRENGTHS)
    for name in ("1.png", "3.png"):
        readings[name] = replace(readings[name], patch=NoStrength("the patch is clipped"))
    _, _, remarks = tied(readings)
    assert "the patch is clipped, in 2 of 6 photos (1.png, 3.png)" in remarks.warnings


def test_without_a_patch_the_scale_is_relative_but_the_proportions_hold():
    readings = {
        n: replace(r, patch=NoStrength("the set has no white patch")) for n, r in told(STRENGTHS).items()
    }
    values, scale, _ = tied(readings, replace(SET, white_patches=()))
    assert scale == "relative"
    ratios = [values[n].value / s for n, s in STRENGTHS.items()]
    np.testing.assert_allclose(ratios, np.broadcast_to(ratios[0], (6, 3)), rtol=1e-9)


@pytest.mark.parametrize("patches, board", [((PATCH,), None), ((), BOARD), ((), None)])
def test_lamps_that_nothing_read_measures_are_equal_more_or_less_and_that_is_told(patches, board):
    """As surely as the manifest has it, where nothing was laid out to measure them."""
    patch = "the patch is clipped" if patches else "the set has no white patch"
    blind = StrengthReadings(*(NoStrength(p) for p in (patch, "too little lit paper is seen", "no print")))
    values, scale, remarks = tied(
        dict.fromkeys(STRENGTHS, blind), replace(SET, white_patches=patches, board=board)
    )
    measured = bool(patches or board)
    assert scale == "relative"
    for one in values.values():
        np.testing.assert_array_equal(one.value, 1.0)
        assert (0.01 < (one.error / one.value).max() < 0.05) == measured
        assert one.error.any() == measured
    assert any("equally strong" in w for w in remarks.warnings) == measured
    assert any("clipped" in w for w in remarks.warnings) == bool(patches)


def test_patches_that_are_unevenly_lit_are_better_than_none():
    """If all are, the scale is theirs, with their unevenness for its error; where one is evenly lit it alone counts."""
    uneven = {
        n: replace(r, patch=replace(NoStrength(UNEVEN), rough=replace(r.patch, error=0.06 * r.patch.value)))
        for n, r in told(STRENGTHS).items()
    }
    values, scale, remarks = tied(dict(uneven))
    assert scale == "absolute" and any("no white patch is evenly lit" in w for w in remarks.warnings)
    assert remarks.residuals["uneven_patches_error"] == pytest.approx(0.06)
    for name, true in STRENGTHS.items():
        np.testing.assert_allclose(values[name].value, true, rtol=1e-9)
    wrong = {
        n: replace(r, patch=replace(r.patch, rough=strength(0.7 * STRENGTHS[n]))) for n, r in uneven.items()
    }
    values, _, remarks = tied(wrong | {"2.png": told(STRENGTHS)["2.png"]})
    np.testing.assert_allclose(values["4.png"].value, STRENGTHS["4.png"], rtol=1e-9)
    assert not any("no white patch" in w for w in remarks.warnings)


def test_lamps_of_stated_proportions_are_put_on_the_papers_scale():
    """What shines beside them is measured in radiance, and can then be weighed against them."""
    unknown = NoStrength("the set has no white patch")
    readings = {n: replace(r, patch=unknown) for n, r in told(STRENGTHS).items()}
    given = {n: 1e-3 * s for n, s in STRENGTHS.items()}
    lights = dict.fromkeys(readings, FAR)
    values, scale = tie(replace(SET, white_patches=()), readings, lights, given, Remarks())
    assert scale == "relative"
    for name, true in STRENGTHS.items():  # as of paper that is perfectly white
        np.testing.assert_allclose(values[name].value, true * PAPER * np.pi, rtol=1e-9)
        assert values[name].source == "board" and not values[name].error.any()


def test_a_lamp_that_nothing_measures_is_taken_as_the_others_and_said_so():
    same = {n: STRENGTH for n in STRENGTHS}
    readings = told(same)
    readings["5.png"] = StrengthReadings(NoStrength("clipped"), NoStrength("dark"), NoStrength("dark"))
    values, _, remarks = tied(readings)
    np.testing.assert_allclose(values["5.png"].value, STRENGTH, rtol=1e-9)
    assert any(w.startswith("5.png") and "taken as the others" in w for w in remarks.warnings)


def test_lamps_that_agree_are_one_lamp_and_surer():
    rng = np.random.default_rng(4)
    values, _, remarks = tied(told({n: STRENGTH * (1 + 0.001 * rng.normal()) for n in STRENGTHS}))
    assert remarks.residuals["lamps_taken_as_equal"]
    found = np.array([v.value for v in values.values()])
    alone = [abs(0.001 * z) for z in np.random.default_rng(4).normal(size=6)]
    assert np.mean(np.abs(found / STRENGTH - 1)) < np.mean(alone)
    np.testing.assert_allclose(found, np.broadcast_to(STRENGTH, found.shape), rtol=0.002)
    differing, _, other = tied(told(STRENGTHS))
    assert "lamps_taken_as_equal" not in other.residuals
    assert np.ptp([v.value[0] for v in differing.values()]) > STRENGTH[0]


def test_a_lamp_that_differs_from_otherwise_equal_ones_keeps_its_own_strength():
    one_off = {n: STRENGTH * (1.1 if n == "3.png" else 1.0) for n in STRENGTHS}
    values, _, remarks = tied(told(one_off))
    assert remarks.residuals["lamps_taken_as_equal"]
    np.testing.assert_allclose(values["3.png"].value, 1.1 * STRENGTH, rtol=0.003)
    np.testing.assert_allclose(values["1.png"].value, STRENGTH, rtol=0.003)


def test_without_a_believed_patch_the_paper_keeps_the_proportions():
    refused = {
        n: replace(r, patch=NoStrength("the patch lies in shadow")) for n, r in told(STRENGTHS).items()
    }
    values, scale, _ = tied(refused)
    assert scale == "relative"
    ratios = [values[n].value / s for n, s in STRENGTHS.items()]
    np.testing.assert_allclose(ratios, np.broadcast_to(ratios[0], (6, 3)), rtol=1e-9)
