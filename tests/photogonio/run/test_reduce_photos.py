"""Photos to tables, several at a time: the same bytes however many, and whatever was at hand."""

import os
from dataclasses import fields, replace

import cv2
import numpy as np
import pytest

from photogonio.cache.kept import key_of
from photogonio.cache.store import Store, default_store
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.setup import Light, Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MirrorBall, Sphere
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.run.reduce_photos import Plan, reduce_photos
from photogonio.system.provenance import hash_file, hash_photos

SIZE = (200, 150)
MATRIX = np.array([[500.0, 0, 99.5], [0, 500.0, 74.5], [0, 0, 1]])
DOWN = Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 300.0]))  # looks down the world's z
LIGHTS = np.array([[0.0, 0, 400], [200, 50, 300], [-150, 180, 300], [60, -250, 250]])


def write_set(folder, files):
    rows = [
        f'[[photo]]\nfile = "{name}"\nrole = "sample"\nlight = "{name}"\nexposure_time = 0.5'
        for name in files
    ]
    (folder / "photoset.toml").write_text(
        'format = 1\n[sample]\nshape = "sphere"\ncenter = [0, 0, 0]\nradius = 30.0\n'
        "[radiometry]\ngain_electrons = 20000\n"
        f"[camera]\nmatrix = {MATRIX.tolist()}\nrotation = {DOWN.rotation.tolist()}\n"
        f"translation = {DOWN.translation.tolist()}\n" + "\n".join(rows) + "\n"
    )


def write_photo(path, seed):
    rng = np.random.default_rng(seed)
    cv2.imwrite(str(path), rng.integers(9000, 11000, (SIZE[1], SIZE[0], 3), dtype=np.uint16))


def made_setup(files):
    views = []
    for name, place in zip(files, LIGHTS, strict=False):
        light = Light(name, "point", place, np.zeros((3, 3)), "given", 5.0)
        views.append(ViewSetup(name, light, DOWN, np.full(3, 1e5), np.zeros(3), "intensity"))
    camera = Camera(MATRIX, np.zeros(5), SIZE)
    return Setup(camera, Sphere(np.zeros(3), 30.0), tuple(views), "relative", ("R", "G", "B"))


@pytest.fixture
def job(tmp_path):
    """Reduces the set as it stands; ``job.folder`` holds it."""

    class Job:
        folder, files = tmp_path / "set", [f"s{k}.png" for k in range(3)]
        store = Store(tmp_path / "kept")

        def run(self, *, setup=None, progress=lambda done, total: None, **plan):
            write_set(self.folder, self.files)
            reader = prepare(load_photoset(self.folder))
            plan = Plan(**{"level": 3, "options": ReduceOptions()} | plan)
            return reduce_photos(reader, setup or made_setup(self.files), plan, progress)

    Job.folder.mkdir()
    for k, name in enumerate(Job.files):
        write_photo(Job.folder / name, k)
    return Job()


def bytes_of(table):
    return [
        value.tobytes() if isinstance(value, np.ndarray) else value
        for value in (getattr(table, f.name) for f in fields(table))
    ]


def test_any_number_of_workers_gives_the_same_bytes(job):
    one, two, eight = (job.run(workers=n) for n in (1, 2, 8))
    assert one.table.groups == tuple(job.files) and len(one.table) > 100
    assert bytes_of(one.table) == bytes_of(two.table) == bytes_of(eight.table)


def test_finished_photos_are_at_hand_and_give_the_same_bytes(job):
    plain = job.run()
    first, second = job.run(store=job.store), job.run(store=job.store, workers=2)
    assert (first.at_hand, second.at_hand) == (0, 3)
    assert bytes_of(plain.table) == bytes_of(first.table) == bytes_of(second.table)
    assert first.hashes == second.hashes == {f: hash_file(job.folder / f) for f in job.files}
    files = [*job.files, "photoset.toml"]
    assert hash_photos(job.folder, files, known=first.hashes) == hash_photos(job.folder, files)


def test_a_run_that_was_broken_off_goes_on(job):
    """Ctrl-C while the second photo is reported: those finished are not done again."""

    def break_off(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        job.run(store=job.store, progress=break_off)
    resumed = job.run(store=job.store)
    assert 2 <= resumed.at_hand <= 3
    assert bytes_of(resumed.table) == bytes_of(job.run().table)


def test_one_more_photo_is_the_only_one_reduced(job):
    job.run(store=job.store)
    job.files = [*job.files, "s3.png"]
    write_photo(job.folder / "s3.png", 3)
    more = job.run(store=job.store)
    assert more.at_hand == 3
    assert bytes_of(more.table) == bytes_of(job.run().table)


def test_a_damaged_entry_is_done_again(job):
    plain = job.run(store=job.store)
    entry = next(job.store.folder.glob("*/*.table"))
    entry.write_bytes(entry.read_bytes()[:-100])
    again = job.run(store=job.store)
    assert again.at_hand == 2 and bytes_of(again.table) == bytes_of(plain.table)
    assert job.run(store=job.store).at_hand == 3


def changed_photo(job):
    write_photo(job.folder / "s1.png", 99)
    return {}, 2


def changed_options(job):
    return {"options": ReduceOptions(theta_i_max=1.2)}, 0


def changed_ball(job):
    return {"options": ReduceOptions(mirror_balls=(MirrorBall(np.array([50.0, 0, 0]), 8.0),))}, 0


def changed_level(job):
    return {"level": 2}, 0


def changed_light(job):
    setup = made_setup(job.files)
    views = list(setup.views)
    views[2] = replace(views[2], strength=2 * views[2].strength)
    return {"setup": replace(setup, views=tuple(views))}, 2


def changed_lens(job):
    setup = made_setup(job.files)
    camera = replace(setup.camera, distortion=np.array([0.01, 0, 0, 0, 0]))
    return {"setup": replace(setup, camera=camera)}, 0


@pytest.mark.parametrize(
    "change", [changed_photo, changed_options, changed_ball, changed_level, changed_light, changed_lens]
)
def test_what_a_table_depends_on_is_in_its_key(job, change):
    job.run(store=job.store)
    more, at_hand = change(job)
    found = job.run(store=job.store, **more)
    assert found.at_hand == at_hand
    assert bytes_of(found.table) == bytes_of(job.run(**more).table)


def test_a_photo_that_cannot_be_used_is_left_out_by_name(job):
    cv2.imwrite(str(job.folder / "s0.png"), np.zeros((SIZE[1], SIZE[0], 3), np.uint16))
    (job.folder / "s2.png").write_bytes((job.folder / "s2.png").read_bytes()[:5000])
    found = job.run(workers=2, store=job.store)
    assert [photo.name for photo in found.left_out] == ["s0.png", "s2.png"]
    assert "black" in found.left_out[0].reason and "truncated" in found.left_out[1].reason
    assert found.table.groups == ("s1.png",)


def test_no_photo_at_all_is_refused(job):
    for name in job.files:
        cv2.imwrite(str(job.folder / name), np.full((SIZE[1], SIZE[0], 3), 65535, np.uint16))
    with pytest.raises(InputError, match="no sample photo can be used"):
        job.run()


def test_a_view_without_the_sample_is_left_out(job):
    setup = made_setup(job.files)
    away = Pose(DOWN.rotation, DOWN.translation + np.array([1000.0, 0, 0]))
    views = (replace(setup.views[0], pose=away), *setup.views[1:])
    found = job.run(setup=replace(setup, views=views))
    assert found.left_out[0].name == "s0.png" and "outside" in found.left_out[0].reason


def test_progress_counts_every_photo(job):
    told = []
    job.run(workers=2, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_keys_follow_contents():
    a = {"x": np.arange(3.0), "y": (1, None, "s")}
    assert key_of(a) == key_of({"y": (1, None, "s"), "x": np.arange(3.0)})
    others = [
        {"x": np.arange(3), "y": (1, None, "s")},
        {"x": np.arange(3.0).reshape(3, 1), "y": (1, None, "s")},
        {"x": np.arange(3.0), "y": (1, None, "t")},
        {"x": np.arange(3.0), "y": (1.0, None, "s")},
        {"x": np.arange(3.0), "y": ((1, None), "s")},
    ]
    assert len({key_of(a), *map(key_of, others)}) == 6
    with pytest.raises(TypeError):
        key_of(object())


def test_the_store_drops_what_was_not_used_for_longest(job):
    job.run(store=job.store)
    entries = sorted(job.store.folder.glob("*/*.table"))
    for age, entry in enumerate(entries):
        os.utime(entry, (1e9 - age, 1e9 - age))
    job.store.prune(entries[0].stat().st_size + entries[1].stat().st_size)
    assert sorted(job.store.folder.glob("*/*.table")) == entries[:2]


def test_the_environment_names_the_store_or_forbids_it(monkeypatch, tmp_path):
    monkeypatch.setenv("PHOTOGONIO_CACHE", str(tmp_path))
    assert default_store().folder == tmp_path
    monkeypatch.setenv("PHOTOGONIO_CACHE", "")
    assert default_store() is None
    monkeypatch.delenv("PHOTOGONIO_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert "photogonio" in str(default_store().folder)


def test_a_store_that_cannot_be_written_stops_nothing(job, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    assert job.run(store=Store(blocked)).at_hand == 0
