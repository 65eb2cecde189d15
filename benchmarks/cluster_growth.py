"""How time, bytes and memory grow with the photos that a cluster reduces; and what becomes of workers that are killed.

    python -m benchmarks.cluster_growth [--quick] [--photos 60,240,960] [--workers 2] [--megapixels 0.3] [--turns 3]
                                        [--send] [--kills 0]
    python -m benchmarks.cluster_growth --scheduler 10000 [--workers 2] [--kilobytes 113]
    python -m benchmarks.cluster_growth --graph 10000 [--workers 2] [--megapixels 0.01]

Drawn photos with the calibration known, reduced here and by workers that are processes of a local dask cluster, in
turns. "there" over "here" is the ratio of their times, with the same number of workers, medians of the turns; "sent"
are the photos' bytes with --send, as if no folder were shared; "back" the tables'. "scheduler" is the largest
resident memory of the process that holds the scheduler and nothing else. With --kills, so many times two workers are
killed (-9) while photos are reduced; their nannies start others, and no photo may be kept twice. "cpu" are the
seconds of processors on either side, all processes: where other work has the machine, their ratio tells more than the
clock's. Bytes of tables must be the same, else the exit status is 1. Last, the powers p of quantity ~ photos^p.
--scheduler sends back so many tables of chance, as large as those of photos here, as many under way as `process` has,
and tells the scheduler's largest memory on the way. --graph tells the same of so many photos as `process` reduces
them, with all that is sent for each; small ones do.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from benchmarks.end_to_end import made_setup, make_set
from photogonio.cache.store import Store
from photogonio.calib.setup import Setup
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.manifest.load import load_photoset
from photogonio.reconstruct.reduce.directions import ReduceOptions
from photogonio.reconstruct.table.facet_table import SUMS, FacetTable
from photogonio.run.cluster import ABREAST, Cluster, as_a_program, cluster_of
from photogonio.run.reduce_photos import Plan, reduce_photos

LEVEL, SHARE = 3, 0.06
SECONDS = 3.0  # between kills, at most
UNWATCHED = {  # as packaging/slurm-one-set.sh has it
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
}


@dataclass(frozen=True, slots=True)
class Row:
    """One size of set."""

    photos: int
    here: float  # seconds
    there: float
    cpu_here: float  # seconds of processors
    cpu_there: float
    sent: float  # MB of photos
    back: float  # MB of tables
    scheduler: float  # MB


class Scheduler:
    """A dask scheduler and its workers, each a process of its own."""

    def __init__(self, workers: int):
        dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
        self.folder = tempfile.TemporaryDirectory()
        self.file = Path(self.folder.name) / "scheduler.json"
        environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1]), **UNWATCHED}
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": Path(__file__).parents[1]}
        quiet["env"] = environment
        words = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(self.file)]
        self.process = subprocess.Popen([*dask, *words], **quiet)
        dask = [sys.executable, "-m", "distributed.cli.dask_worker"]
        words = [
            "--scheduler-file",
            str(self.file),
            "--nworkers",
            str(workers),
            "--nthreads",
            "1",
            "--no-dashboard",
        ]
        self.workers = subprocess.Popen([*dask, *words, "--local-directory", self.folder.name], **quiet)

    @property
    def address(self) -> str:
        """``dask://HOST:PORT``, when it is up."""
        import json

        for _ in range(600):
            if self.file.is_file() and self.file.stat().st_size:
                return json.loads(self.file.read_text())["address"].replace("tcp://", "dask://")
            time.sleep(0.1)
        raise TimeoutError("the scheduler did not start")

    def peak(self) -> float:
        """MB, NaN where the system does not tell."""
        try:
            lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        except OSError:
            return float("nan")
        return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))

    def busy(self) -> float:
        """Seconds of processors so far, of processes that live."""
        import psutil  # which distributed brings

        first = [psutil.Process(one.pid) for one in (self.process, self.workers)]
        times = [one.cpu_times() for one in (*first, *first[1].children(recursive=True))]
        return sum(one.user + one.system for one in times)

    def running(self) -> list[int]:
        """Numbers of the workers' processes."""
        import psutil

        children = psutil.Process(self.workers.pid).children(recursive=True)
        return [one.pid for one in children if "spawn_main" in " ".join(one.cmdline())]

    def close(self) -> None:
        for process in (self.workers, self.process):
            process.terminate()
        for process in (self.workers, self.process):
            process.wait()
        self.folder.cleanup()


def chance(kilobytes: int) -> np.ndarray:
    """On a worker: a table's bytes, that nothing makes smaller."""
    return np.random.default_rng().random(kilobytes * 125)


def tell_scheduler(cluster: Cluster, scheduler: Scheduler, options: argparse.Namespace) -> None:
    """Memory of the scheduler's process while tables come back."""
    pool, waiting = cluster.client.get_executor(pure=False), set[Future[np.ndarray]]()
    start, sent, done = time.perf_counter(), 0, 0
    print(f"     0 tables  scheduler {scheduler.peak():6.1f} MB", flush=True)
    while done < options.scheduler:
        while sent < options.scheduler and len(waiting) < ABREAST * options.workers:
            waiting.add(pool.submit(chance, options.kilobytes))
            sent += 1
        came, waiting = wait(waiting, None, FIRST_COMPLETED)
        for future in came:
            assert future.result().nbytes == 1000 * options.kilobytes
            done += 1
            if done in (options.scheduler, *(10**k for k in range(2, 9)), *(3 * 10**k for k in range(2, 9))):
                seconds = time.perf_counter() - start
                print(f"{done:6} tables  scheduler {scheduler.peak():6.1f} MB  {seconds:7.1f} s", flush=True)


def tell_graph(folder: Path, cluster: Cluster, scheduler: Scheduler, options: argparse.Namespace) -> None:
    """Memory of the scheduler's process while photos are reduced."""
    setup = made_setup(options.graph, ".png", SHARE, options.megapixels)
    make_set(folder, setup, ".png")
    reader, start = prepare(load_photoset(folder)), time.perf_counter()
    steps = {options.graph, *(k * 10**n for n in range(1, 9) for k in (1, 3))}

    def tell(done: int, total: int) -> None:
        if done in steps:
            seconds = time.perf_counter() - start
            print(f"{done:6} photos  scheduler {scheduler.peak():6.1f} MB  {seconds:7.1f} s", flush=True)

    before = scheduler.busy() + time.process_time()
    table = reduce_photos(
        reader, setup, Plan(LEVEL, ReduceOptions(), options.workers, cluster=cluster), tell
    ).table
    used = scheduler.busy() + time.process_time() - before
    print(
        f"{used / options.graph * 1e3:.1f} ms of processors a photo, {len(table)} cells, {table.nbytes / 1e6:.1f} MB"
    )


def timed(reader: RadianceReader, setup: Setup, plan: Plan) -> tuple[float, FacetTable]:
    start = time.perf_counter()
    table = reduce_photos(reader, setup, plan).table
    return time.perf_counter() - start, table


def same(one: FacetTable, other: FacetTable) -> bool:
    pairs = [(getattr(one, f.name), getattr(other, f.name)) for f in fields(FacetTable)]
    return all(a.tobytes() == b.tobytes() if isinstance(a, np.ndarray) else a == b for a, b in pairs)


class Counted(Store):
    """Keeps, and counts how often each photo came."""

    def __init__(self, folder: Path):
        super().__init__(folder)
        self.came = Counter[str]()

    def put(self, key: str, table: FacetTable) -> bool:
        self.came[key] += 1
        return super().put(key, table)


class Killer(threading.Thread):
    """Kills two workers now and then until it is told to stop."""

    def __init__(self, scheduler: Scheduler, kills: int):
        super().__init__(daemon=True)
        self.scheduler, self.left, self.done = scheduler, kills, threading.Event()
        self.killed = 0

    def run(self) -> None:
        rng = np.random.default_rng(1)
        while self.left and not self.done.wait(rng.uniform(0.2, SECONDS)):
            # the system is asked: workers that are being started would let the cluster wait
            for process in rng.permutation(self.scheduler.running())[:2]:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(int(process), signal.SIGKILL)
                    self.killed += 1
            self.left -= 1


def measured(
    folder: Path, photos: int, cluster: Cluster, scheduler: Scheduler, options: argparse.Namespace
) -> Row:
    setup, reader = made_setup(photos, ".png", SHARE, options.megapixels), prepare(load_photoset(folder))
    cluster.sending, cluster.sent = options.send, 0
    here = Plan(LEVEL, ReduceOptions(), options.workers)
    there = Plan(LEVEL, ReduceOptions(), options.workers, cluster=cluster)
    few = made_setup(min(photos, 8 * options.workers), ".png", SHARE, options.megapixels)
    for plan in (here, there):  # loads what is compiled
        timed(reader, few, plan)
    cluster.sent, times = 0, []
    for turn in range(options.turns):
        made = folder.with_name(f"{photos}-kept-{turn}")
        start = time.process_time()
        seconds_here, table = timed(reader, setup, here)
        cpu_here = time.process_time() - start
        killer = Killer(scheduler, options.kills)
        killer.start()
        kept = Counted(made) if options.kills else None
        start = time.process_time() + scheduler.busy()
        seconds_there, other = timed(reader, setup, replace(there, store=kept))
        cpu_there = time.process_time() + scheduler.busy() - start if not options.kills else float("nan")
        killer.done.set()
        killer.join()
        if kept is not None:
            print(f"{killer.killed} workers killed, {len(kept.came)} photos kept", flush=True)
            if len(kept.came) != photos or max(kept.came.values()) > 1:
                raise SystemExit(f"{photos} photos: some lost, or kept twice")
        if not same(table, other):
            raise SystemExit(f"{photos} photos: other bytes than here")
        times.append((seconds_here, seconds_there, cpu_here, cpu_there))
    back = sum(getattr(table, name).nbytes for name in ("group", "facet_i", "facet_r", *SUMS))
    sent = cluster.sent / options.turns
    return Row(photos, *np.median(times, axis=0), sent / 1e6, back / 1e6, scheduler.peak())


def told(rows: Sequence[Row]) -> None:
    """The laws."""
    if len(rows) < 2:
        return
    photos = np.log([row.photos for row in rows])
    for name in ("here", "there", "cpu_here", "cpu_there", "sent", "back", "scheduler"):
        values = np.array([getattr(row, name) for row in rows])
        if (values > 0).all():
            print(f"{name:10} ~ photos^{np.polyfit(photos, np.log(values), 1)[0]:.2f}")


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few small photos: shows that it runs")
    parser.add_argument("--photos", default="60,240,960")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--turns", type=int, default=3, help="of here and there, for each number of photos")
    parser.add_argument("--megapixels", type=float, help="of a photo; 0.3, or with --graph 0.01")
    parser.add_argument("--send", action="store_true", help="photos are sent to the workers")
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--scheduler", type=int, default=0, metavar="TABLES", help="only its memory")
    parser.add_argument("--graph", type=int, default=0, metavar="PHOTOS", help="only its memory, with photos")
    parser.add_argument("--kilobytes", type=int, default=113, help="of a table of chance")
    options = parser.parse_args(arguments)
    if options.megapixels is None:
        options.megapixels = 0.01 if options.graph else 0.3
    if options.quick:
        options.photos, options.megapixels, options.turns = "2,4", 0.05, 1
    as_a_program()  # as workers do, and `process`
    scheduler, rows = Scheduler(options.workers), []
    try:
        with tempfile.TemporaryDirectory() as made, cluster_of(scheduler.address) as cluster:
            assert cluster is not None
            cluster.client.wait_for_workers(options.workers)
            if options.scheduler:
                tell_scheduler(cluster, scheduler, options)
                return 0
            if options.graph:
                tell_graph(Path(made) / "graph", cluster, scheduler, options)
                return 0
            for photos in map(int, options.photos.split(",")):
                folder = Path(made) / str(photos)
                make_set(folder, made_setup(photos, ".png", SHARE, options.megapixels), ".png")
                rows.append(row := measured(folder, photos, cluster, scheduler, options))
                ratio = f"here {row.here:7.2f} s  there {row.there:7.2f} s  x {row.there / row.here:5.2f}"
                cpu = f"cpu {row.cpu_here:6.2f} {row.cpu_there:6.2f} s  x {row.cpu_there / row.cpu_here:5.2f}"
                volume = (
                    f"sent {row.sent:8.1f} MB  back {row.back:8.1f} MB  scheduler {row.scheduler:5.0f} MB"
                )
                print(f"{row.photos:6} photos  {ratio}  {cpu}  {volume}  same bytes", flush=True)
    finally:
        scheduler.close()
    told(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
