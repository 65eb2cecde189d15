"""Photos reduced by a cluster's workers: the same bytes as here, whoever they are and whatever becomes of them."""

from __future__ import annotations

import pickle
import socket
import threading
import warnings
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from photogonio.cache.store import Store
from photogonio.capture.errors import InputError
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.run import cluster
from photogonio.run.reduce_photos import Plan, reduce_photos
from photogonio.run.task_queue import LEAST, TASK, TaskQueue
from photogonio.system.provenance import hash_file
from tests.photogonio.run.test_reduce_photos import SIZE, bytes_of, made_setup, write_photo, write_set

FILES = [f"s{k}.png" for k in range(4)]


@pytest.fixture(scope="module")
def photos(tmp_path_factory) -> Path:
    """Four photos, of which the last is black."""
    folder = tmp_path_factory.mktemp("cluster") / "set"
    folder.mkdir()
    write_set(folder, FILES)
    for k, name in enumerate(FILES[:3]):
        write_photo(folder / name, k)
    cv2.imwrite(str(folder / FILES[3]), np.zeros((SIZE[1], SIZE[0], 3), np.uint16))
    return folder


@pytest.fixture(scope="module")
def scheduler():
    """Two workers that are spoken to over the network."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, protocol="tcp", dashboard_address=None
        ) as made:
            yield made.scheduler_address.replace("tcp://", "dask://")


def reduced(folder: Path, **plan):
    plan = Plan(**{"level": 2, "options": ReduceOptions()} | plan)
    return reduce_photos(prepare(load_photoset(folder)), made_setup(FILES), plan)


def test_the_same_bytes_as_here_and_nothing_twice(photos, scheduler, tmp_path):
    here, store = reduced(photos, workers=2), Store(tmp_path / "kept")
    with cluster.cluster_of(scheduler) as workers:
        there = reduced(photos, cluster=workers, store=store)
        again = reduced(photos, cluster=workers, store=store)
        assert workers.sent == 0
        assert bytes_of(there.table) == bytes_of(again.table) == bytes_of(here.table)
        assert (there.at_hand, again.at_hand) == (0, 3)
        assert there.left_out == here.left_out and "black" in there.left_out[0].reason
        # a worker that does not find the files has them sent
        monkey = pytest.MonkeyPatch()
        monkey.setattr(cluster, "_has_files", lambda folder, hashes: False)
        with monkey.context():
            sent = reduced(photos, cluster=workers)
        monkey.undo()
        assert bytes_of(sent.table) == bytes_of(here.table) and sent.left_out == here.left_out
        assert workers.sent >= sum((photos / name).stat().st_size for name in FILES)


def test_tables_come_straight_from_workers_that_can_be_reached(scheduler):
    with cluster.cluster_of(scheduler) as workers:
        assert workers._threads() == 2 and workers.client.direct_to_workers
        assert all(future.result() is None for future in workers.made_ready)
        with socket.create_server(("127.0.0.1", 0)) as once:
            gone = f"tcp://127.0.0.1:{once.getsockname()[1]}"
        workers._come_near([*workers.near, gone])
        assert not workers.client.direct_to_workers
        workers._come_near([at for at in workers.near if at != gone])  # it left
        assert workers.client.direct_to_workers
    assert not cluster._takes_connections("inproc://somewhere/1")


def test_tasks_grow_to_half_a_second_and_shrink_toward_the_end():
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    queue, sizes, seen = TaskQueue(240), [], []
    while queue.left:
        numbers = queue.task(4)
        seen += numbers
        sizes.append(len(numbers))
        done: cluster.Future = cluster.Future()
        done.set_result(np.frombuffer(pickle.dumps((numbers, 0.02 * len(numbers))), np.uint8))
        assert queue.found(done, numbers) == numbers
    assert seen == list(range(240))  # each once, in their order
    assert sizes[0] == 1 and max(sizes) == TASK / 0.02
    assert sizes[-2] == LEAST / 0.02 and sorted(sizes[1:], reverse=True) == sizes[1:]
    assert len(sizes) < 24  # each has its price
    alone = TaskQueue(3)
    assert [alone.task(1, 1) for _ in range(3)] == [[0], [1], [2]]


def test_photos_that_are_sent_go_by_their_bytes(photos):
    one = object.__new__(cluster.Cluster)
    view, photo = made_setup(FILES).views[0], load_photoset(photos).views("sample")[0]
    ask = cluster.Ask(view, photo, {"a": cluster.FileMark(cluster.SENT // 4, 0, "")})
    large = replace(ask, files={"a": cluster.FileMark(4 * cluster.SENT, 0, "")})
    one.sending = True
    assert (one._most(ask), one._most(large)) == (4, 1)
    one.sending = False
    assert one._most(large) == cluster.MOST


def test_workers_of_another_version_are_refused_by_name(scheduler, monkeypatch):
    with cluster.cluster_of(scheduler) as workers:
        # workers answer in a thread of their own
        monkeypatch.setattr(cluster, "code_key", lambda: threading.current_thread().name)
        with pytest.raises(InputError, match=r"worker .*tcp://.* of another version"):
            cluster.Cluster(workers.client, "--executor")


def test_a_worker_looks_at_the_version_and_at_the_files(photos, monkeypatch):
    work = cluster.Work(prepare(load_photoset(photos)), made_setup(FILES), 2, ReduceOptions())
    view = made_setup(FILES).views[0]
    mark = cluster.FileMark.of(photos / FILES[0], hash_file(photos / FILES[0]))
    ask = cluster.Ask(view, load_photoset(photos).views("sample")[0], {FILES[0]: mark})
    assert cluster.opened("another", pickle.dumps(work)) is None
    here, later = photos / FILES[0], replace(mark, changed=mark.changed + 1)
    assert mark.fits(here) and replace(mark, digest="").fits(here) and later.fits(here)
    # other bytes under the same name, and a name that is not here
    assert not replace(later, digest="0" * 64).fits(here) and not replace(mark, size=mark.size + 1).fits(here)
    assert not mark.fits(photos / "nowhere.png")
    ask = replace(ask, files={FILES[0]: replace(later, digest="")})
    assert cluster.answer(cluster.code_key(), work, ask) == cluster.Lacking()
    sent = replace(ask, sent={FILES[0]: (photos / FILES[0]).read_bytes()})
    readied = []
    monkeypatch.setattr(cluster, "as_a_program", lambda: readied.append(1))
    # also where another worker unpacked what photos share
    (found,), seconds = pickle.loads(cluster.answers_of(cluster.code_key(), work, [sent]).data)
    assert readied and seconds > 0.0
    assert bytes_of(found.table) == bytes_of(cluster.seen_in(work, view, ask.photo).table)


def test_a_photo_that_kills_its_workers_is_done_here():
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    killed = distributed.KilledWorker("photo", None, 3)

    class Pool:
        """Every task with the third photo kills its workers."""

        def submit(self, work, code, shared, asks):
            done: cluster.Future = cluster.Future()
            tasks.append(list(asks))
            if "c" in asks:
                done.set_exception(killed)
            else:
                found = [f"there: {ask}" for ask in asks], 1e-3 * len(asks)
                done.set_result(np.frombuffer(pickle.dumps(found), np.uint8))
            return done

    tasks: list[list[str]] = []
    one = object.__new__(cluster.Cluster)
    one.sending, one._shared, one._threads = False, lambda work: None, lambda: 1
    one._filled, one._most = lambda work, ask: ask, lambda ask: cluster.MOST
    one.client = type("Client", (), {"get_executor": lambda self, pure: Pool()})()
    found = dict(one.answers(None, "abcdefgh", lambda ask: f"here: {ask}"))
    assert found == {k: f"{'here' if name == 'c' else 'there'}: {name}" for k, name in enumerate("abcdefgh")}
    assert max(map(len, tasks)) > 1  # quick photos go several a task
    assert (
        tasks.count(["c"]) == 1 and sum(len(task) for task in tasks if "c" not in task) == 7
    )  # and none twice


def test_no_scheduler_is_said_so(monkeypatch):
    pytest.importorskip("distributed", reason="dask.distributed is not installed")
    monkeypatch.setattr(cluster, "REACHED", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as mute:
        for where, why in (
            ("127.0.0.1:1", "refused"),
            ("no-such-host.invalid:1", ""),
            (f"127.0.0.1:{mute.getsockname()[1]}", "says a word"),
        ):
            with (
                pytest.raises(InputError, match=f"no scheduler.*{why}"),
                cluster.cluster_of(f"dask://{where}"),
            ):
                pass
