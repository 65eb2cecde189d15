"""All of ``process`` against OpenCV's decoding of the same files, with as many workers (of EXR, ours).

    python -m benchmarks.whole [--quick] [--formats png,tif,exr,jpg] [--photos N] [--boards N]

A set with a board is calibrated, reduced, fitted and reported; then again with the calibration known, as after
``photogonio calibrate``. Each run is a process of its own, so that imports count. "decode" reads the photos of the
sample, "all" those of the bare board too. "table" is from the files to the facet table, with the calibration known;
"known" the whole command then; "everything" the whole command the first time. Peaks are of resident memory.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest import mock

from benchmarks.board_set import converted, make_board_set
from photogonio.reconstruct.modes.parallel import cores
from photogonio.system.memory import keep_freed, peak_megabytes

STAGES = ("calibrate", "reduce", "fit", "write")


def child(what: str, folder: Path, out: Path, workers: int, quick: bool) -> dict[str, float]:
    """Seconds of one task in this process, imports of the libraries not counted, and the peak in megabytes."""
    keep_freed()  # as the command does
    if what == "process":
        from photogonio.options import Options
        from photogonio.pipeline import process

        asked = Options(workers=workers, order=2, lobes=0) if quick else Options(workers=workers)
        start = time.perf_counter()
        found = dict(process(folder, out, asked).seconds)
    else:
        import cv2

        from photogonio.capture.files.images import read_image

        cv2.setNumThreads(1)  # the workers are ours

        def decoded(path: Path) -> None:
            if cv2.imread(str(path), cv2.IMREAD_UNCHANGED) is None:  # its wheel knows no EXR
                read_image(path)

        roles = ("sample",) if what == "decode" else ("sample", "calibration")
        files = [path for role in roles for path in sorted((folder / role).iterdir())]
        start, found = time.perf_counter(), {}
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(decoded, files))
    found["seconds"] = time.perf_counter() - start
    found["peak"] = peak_megabytes()
    return found


def apart(what: str, folder: Path, out: Path, options: argparse.Namespace, cache: Path) -> dict[str, float]:
    """:func:`child` in a process of its own, with the wall clock of it all; in this one, but for one task, where it is
    only shown that it runs."""
    if options.quick and what != "decode":
        start = time.perf_counter()
        with mock.patch.dict(os.environ, PHOTOGONIO_CACHE=str(cache)):
            found = child(what, folder, out, options.workers, quick=True)
        return found | {"wall": time.perf_counter() - start}
    command = [sys.executable, "-m", "benchmarks.whole", "--child", what, str(folder), str(out)]
    start = time.perf_counter()
    done = subprocess.run(
        [*command, "--workers", str(options.workers)],
        check=True,
        capture_output=True,
        text=True,
        cwd=Path(__file__).parents[1],
        env=os.environ | {"PHOTOGONIO_CACHE": str(cache)},
    )
    return json.loads(done.stdout.splitlines()[-1]) | {"wall": time.perf_counter() - start}


def measure(folder: Path, made: Path, options: argparse.Namespace) -> dict[str, dict[str, float]]:
    """Decoding alone, everything, and with the calibration known."""
    cache = made / "cache"
    if not options.quick:
        apart("all", folder, made, options, cache)  # into the disk's cache
    found = {what: apart(what, folder, made, options, cache) for what in ("decode", "all")}
    found["everything"] = apart("process", folder, made / "first", options, cache)
    for path in cache.rglob("*.table"):  # the views' results, but not what a calibration leaves
        path.unlink()
        path.with_suffix(".npy").unlink(missing_ok=True)  # what is around the sample in each
    found["known"] = apart("process", folder, made / "second", options, cache)
    for path in (made / "first").iterdir():
        if path.read_bytes() != (made / "second" / path.name).read_bytes():
            raise RuntimeError(f"{path.name} differs between the runs")
    return found


def line(name: str, found: dict[str, dict[str, float]]) -> str:
    decode, whole = found["decode"]["seconds"], found["all"]["seconds"]
    known, every = found["known"], found["everything"]
    table = (known["calibrate"] + known["reduce"]) / decode
    stages = " ".join(f"{every[stage]:6.1f}" for stage in STAGES)
    return (
        f"{name:6} {decode:7.2f} {whole:7.2f}  {table:14.2f}  {known['wall'] / decode:14.2f}"
        f"  {every['wall'] / whole:16.2f}  {stages}  {every['peak']:7.0f}"
    )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few small photos: shows that it runs")
    parser.add_argument("--formats", default="png,tif,exr,jpg")
    parser.add_argument("--photos", type=int, default=24)
    parser.add_argument("--boards", type=int, default=14)
    parser.add_argument("--workers", type=int, default=cores())
    parser.add_argument("--child", nargs=3, metavar=("WHAT", "SET", "OUT"))
    options = parser.parse_args(arguments)
    if options.child:
        what, folder, out = options.child
        print(json.dumps(child(what, Path(folder), Path(out), options.workers, options.quick)), flush=True)
        os._exit(0)  # as the command ends
    photos, boards, megapixels = (3, 4, 0.2) if options.quick else (options.photos, options.boards, 12.0)
    print(f"{photos} + {boards} photos of {megapixels:g} megapixels, {options.workers} workers; seconds")
    print(
        "format  decode     all  table / decode  known / decode  everything / all"
        "  calibr reduce    fit report  peak MB"
    )
    with tempfile.TemporaryDirectory() as made:
        source = Path(made) / "png"
        make_board_set(source, photos, boards, megapixels)
        for name in options.formats.split(","):
            folder = Path(made) / name
            if name != "png":
                converted(source, folder, f".{name}")
            with tempfile.TemporaryDirectory(dir=made) as results:
                print(line(name, measure(folder, Path(results), options)), flush=True)
            if name != "png":
                shutil.rmtree(folder)


if __name__ == "__main__":
    main()
