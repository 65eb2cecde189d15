"""Scene files: what they may say, what is refused, and the plan of photos that follows."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.synthetic.render.world import brdf_of, world_of
from photogonio.synthetic.scene.hard_cases import changed, hard_case, hard_names
from photogonio.synthetic.scene.plan import camera_of, lamp_intensity, look_at, plan, sample_center
from photogonio.synthetic.scene.scene import built_in, load_scene
from photogonio.synthetic.write.manifest import manifest_of


def sample_shots(scene):
    return [shot for shot in plan(scene) if shot.role == "sample"]


@pytest.mark.parametrize("name", [*built_in(), *hard_names()])
def test_every_scene_can_be_planned_and_sees_its_sample(name):
    scene = hard_case(name).scene if name in hard_names() else load_scene(name)
    assert scene.name == name
    camera, center = camera_of(scene), sample_center(scene)
    assert brdf_of(scene)(np.array([0, 0, 1.0]), np.array([0.0, 0.6, 0.8])).shape == (3,)
    shots = sample_shots(scene)
    for shot in shots:
        (x, y), (width, height) = camera.project(shot.pose, center[None])[0], camera.size
        assert 0.3 * width < x < 0.7 * width and 0.3 * height < y < 0.7 * height
        assert all(lamp.place[2] > 0 for lamp in shot.lamps)
        world_of(scene, shot)
    assert len({shot.file for shot in plan(scene)}) == len(plan(scene))


def test_file_lies_over_its_base(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('base = "example"\nbrdf = { model = "lambert" }\n[camera]\nfocal = 900\n')
    scene, base = load_scene(path), load_scene("example")
    assert scene.name == "mine" and scene.brdf == {"model": "lambert"}
    assert scene.camera == replace(base.camera, focal=900.0) and scene.mirror_ball == base.mirror_ball


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[camera]\nfocale = 1\n", "focal"),
        ("[camera]\nfocal = 'long'\n", "float"),
        ("brdf = 3\n", "dict"),
        ("seed = true\n", "int"),
        ("[sample\n", "TOML"),
        ("brdf = { model = 'lambert' }\n[sensor]\nbits = 12\n", "8, 16"),
        ("brdf = { model = 'lambert' }\n[camera]\nmotion = 'fast'\n", "turntable"),
        ("", "brdf"),
        ("base = 'example'\n[lamp]\ncount = 0\n", "lamp.count: expected 1 or more, got 0"),
        ("base = 'example'\n[lamp]\nelevation = [-10.0, 20.0]\n", "two angles above 0"),
        ("base = 'example'\n[camera]\nsize = [600]\n", "camera.size: expected 2 numbers"),
        ("base = 'example'\n[camera]\ndistortion = [0.1, 0.1, 0.1]\n", "0 or 4 or 5"),
        (
            "base = 'example'\n[board]\nkind = 'aruco-grid'\n",
            "board.markers: a board of kind aruco-grid needs it",
        ),
        ("base = 'example'\n[sample]\noutline = [[0, 0], [1, 1]]\n", "three or more corners"),
        (
            "base = 'example'\nwhite_patch = [{ outline = [[0, 0]], reflectance = 1 }]\n",
            "white_patch.outline",
        ),
        ("base = 'example'\n[fault]\ntwo_lamps = [12]\n", "views from 0 to 11, got 12"),
        ("base = 'example'\n[fault]\nmislabelled = [[1]]\n", "pairs of views"),
        ("base = 'example'\n[lamp]\ncount = 2\n[fault]\nmissing = [0, 1]\n", "leaves no view"),
        ("base = 'example'\n[sensor]\nformat = 'heic'\n", "sensor.bits: a heic has 8"),
        ("base = 'example'\n[sensor]\nprimaries = 'p3'\n", "only a jpeg or heic"),
        ("base = 'example'\n[camera]\nhand = {}\n", "hand-held"),
        ("base = 'example'\n[sensor]\ntone = { shape = 'gentel' }\n", "sensor.tone.shape: expected one of"),
        ("base = 'example'\n[sensor.floor]\nrows = 1\n", "rows"),
        ("base = 'nowhere'\n", "no such scene"),
        ("base = 'bad.toml'\n", "without end"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, text, says):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=says) as caught:
        load_scene(path)
    assert "\n" not in str(caught.value)


def test_unknown_names_are_refused_with_the_nearest():
    with pytest.raises(InputError, match="matte-ball"):
        load_scene("mate-ball")


def test_camera_looks_where_it_should():
    eye, target = np.array([30.0, -200.0, 150.0]), np.array([10.0, 20.0, 5.0])
    for roll in (0.0, 0.7):
        pose = look_at(eye, target, roll=roll)
        assert pose.center == pytest.approx(eye)
        assert pose.apply(target) == pytest.approx([0, 0, np.linalg.norm(target - eye)], abs=1e-9)
        assert np.linalg.det(pose.rotation) == pytest.approx(1.0)
    level = look_at(eye, target)
    assert level.apply(target + np.array([0, 0, 5.0]))[1] < 0  # up in the world is up in the picture


def test_lamps_keep_to_their_zone():
    scene = changed(
        load_scene("example"), lamp={"count": 40, "elevation": (20.0, 70.0), "distance": (300.0, 400.0)}
    )
    away = np.array([shot.lamps[0].place for shot in sample_shots(scene)]) - sample_center(scene)
    far = np.linalg.norm(away, axis=1)
    elevation = np.degrees(np.arcsin(away[:, 2] / far))
    assert np.all((far >= 300) & (far <= 400)) and np.all((elevation > 20) & (elevation < 70))
    assert np.ptp(far) > 90
    # even over the zone: the mean sine of elevation is that of the zone
    assert np.sin(np.radians(elevation)).mean() == pytest.approx(
        np.sin(np.radians([20, 70])).mean(), rel=0.01
    )


def test_lamps_in_one_plane_hold_the_camera_too():
    shots = sample_shots(changed(load_scene("example"), lamp={"spread": "plane"}))
    center = sample_center(load_scene("example"))
    across = np.cross(shots[0].pose.center - center, [0, 0, 1.0])
    for shot in shots:
        assert np.dot(shot.lamps[0].place - center, across) == pytest.approx(
            0, abs=1e-6 * np.linalg.norm(across)
        )


def test_turntable_turns_camera_and_lamp_together():
    still = changed(load_scene("example"), camera={"motion": "fixed"})
    turning = changed(load_scene("example"), camera={"motion": "turntable"})
    center = sample_center(still)
    for a, b in zip(sample_shots(still), sample_shots(turning), strict=True):
        assert b.pose.apply(b.lamps[0].place) == pytest.approx(a.pose.apply(a.lamps[0].place), abs=1e-9)
        assert b.pose.apply(center) == pytest.approx(a.pose.apply(center), abs=1e-9)
    eyes = np.array([shot.pose.center for shot in sample_shots(turning)])
    assert np.ptp(eyes[:, 0]) > 300 and np.ptp(eyes[:, 2]) < 1e-9


def test_level_is_what_a_white_facing_the_lamp_would_give():
    scene = load_scene("example")
    radiance = 0.9 / np.pi * lamp_intensity(scene) / np.mean(scene.lamp.distance) ** 2
    assert radiance * scene.sensor.exposure_time == pytest.approx(scene.sensor.level)


def test_faults_are_in_the_plan():
    base = load_scene("example")
    faults = {
        "two_lamps": (3,),
        "moved_after": 6,
        "moved_by": (1.0, 2.0, 0.0),
        "mislabelled": ((0, 1),),
        "missing": (5,),
    }
    shots = sample_shots(changed(base, fault=faults))
    by_view = {shot.view: shot for shot in shots}
    assert 5 not in by_view and len(shots) == 11
    assert len(by_view[3].lamps) == 2 and len(by_view[4].lamps) == 1
    assert by_view[0].light == by_view[1].light == "L001" and by_view[0].lamps[0].id == "L000"
    assert np.array_equal(by_view[7].offset - by_view[6].offset, [1, 2, 0])


def test_lamp_on_the_camera_stays_there():
    scene = load_scene("flash-ball")
    for shot in sample_shots(scene):
        assert shot.pose.apply(shot.lamps[0].place) == pytest.approx(scene.lamp.attached_at, abs=1e-9)


def test_a_flat_sample_lies_where_its_offset_puts_it_and_the_manifest_knows_nothing():
    scene = changed(load_scene("brushed-plane"), sample={"offset": (0.4, -0.3, 0.5)})
    shots = plan(scene)
    for shot in sample_shots(scene):
        world = world_of(scene, shot)
        assert world.heights[world.sample_sheet] == pytest.approx(scene.sample.height + 0.5)
        outline = np.array(scene.sample.outline) + np.array([0.4, -0.3])
        np.testing.assert_allclose(world.outlines[world.sample_sheet], outline)
    written = manifest_of(scene, camera_of(scene), shots)["sample"]
    assert written["outline"] == [list(p) for p in scene.sample.outline]
    assert written["height"] == scene.sample.height


def test_a_hand_misses_its_places_and_every_second_photo_is_by_flash():
    scene = load_scene("phone-plane")
    steady = changed(scene, camera={"hand": None})
    held, meant = sample_shots(scene), sample_shots(steady)
    missed = np.array([a.pose.center - b.pose.center for a, b in zip(held, meant, strict=True)])
    # thirty numbers: their deviation is known to 13 %
    assert missed.std() == pytest.approx(scene.camera.hand.shift, rel=4 * 0.13)
    assert [shot.light for shot in held] == [
        f"L{k:03d}" if k % 2 else "flash" for k in range(scene.lamp.count)
    ]
    for shot in held[::2]:
        assert shot.pose.apply(shot.lamps[0].place) == pytest.approx(scene.lamp.attached_at, abs=1e-9)
    np.testing.assert_array_equal(held[1].lamps[0].place, meant[1].lamps[0].place)
