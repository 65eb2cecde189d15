"""One set of a batch: what its result hangs on, what becomes of it, and how many are worked on at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogonio.batch.ledger import DISTRUSTED, DONE, FAILED, SetEntry
from photogonio.batch.sets import SetPlace
from photogonio.cache.file_hashes import remembered_hashes
from photogonio.cache.kept import key_of, written_key
from photogonio.cache.store import default_store
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST
from photogonio.options import Options
from photogonio.system.progress import Reporter
from photogonio.system.provenance import hash_file, hash_files

if TYPE_CHECKING:
    from photogonio.result import Result

COEFFICIENTS = "coefficients.json"
WRITTEN = (COEFFICIENTS, "setup.json", "table.npz", "report.html")  # of each set
EACH = 1.2e9  # bytes that a set may need


@dataclass(frozen=True, slots=True)
class Job:
    """One set to be processed."""

    place: SetPlace
    key: str
    out: Path
    options: Options
    rig: RigPrior = NOTHING  # what other sets lead to expect
    pool: Mapping[str, object] | None = None  # what is said of that in the ledger


def result_key(place: SetPlace, options: Options) -> str:
    """A hash of all that shapes a result's files: the program, its templates and libraries, what was asked, the set's
    files, and the folder's name, which the result tells.

    Raises:
        InputError: the manifest cannot be used, or a photo cannot be read.
    """
    photoset = load_photoset(place.folder)
    files = [place.folder / name for name in sorted({photo.file for photo in photoset.photos})]
    store = default_store()
    try:
        manifest = hash_file(place.folder / MANIFEST)
        if store is None:
            hashes = hash_files(files, workers=1)
        else:
            hashes = remembered_hashes(store, key_of("hashes", str(place.folder)), files, workers=1)
    except OSError as error:
        raise InputError(error.filename or place.folder, error.strerror or "cannot be read") from None
    named = {path.relative_to(place.folder).as_posix(): digest for path, digest in hashes.items()}
    asked = replace(options, workers=None, executor=None)  # who does it leaves no trace
    return key_of("batch", written_key(), asked, place.folder.resolve().name, manifest, named)


def processed(job: Job) -> SetEntry:
    """Process one set; a set that cannot be used is an entry too."""
    # only here: who finds all sets done before, or gives them to others, need not wait for compiled code
    from photogonio.pipeline import process
    from photogonio.report.trust import verdict_lines

    try:
        result = process(job.place.folder, job.out, job.options, Reporter(quiet=True), job.rig)
        written = hash_file(job.out / COEFFICIENTS)
    except Exception as error:
        return SetEntry(job.place.name, job.key, FAILED, why(error, job))
    said = " · ".join(verdict_lines(result.faults))
    status = DISTRUSTED if result.faults else DONE
    pool = {} if job.pool is None else {"pool": job.pool}
    return SetEntry(job.place.name, job.key, status, said, numbers_of(result) | pool, written)


def is_there(entry: SetEntry, out: Path) -> bool:
    """Whether a set's files are there, the coefficients those that the ledger tells of: another run may have written
    others since."""
    try:
        return (
            all((out / name).is_file() for name in WRITTEN) and hash_file(out / COEFFICIENTS) == entry.result
        )
    except OSError:
        return False


def why(error: Exception, job: Job) -> str:
    """In one line. What is no fault of the set stops no other set either."""
    if isinstance(error, InputError):
        text = str(error)
    elif isinstance(error, MemoryError):
        text = "there is not memory enough for this"
    elif isinstance(error, OSError):  # without the file's name, which has chance in it
        text = f"{job.out}: {(error.strerror or str(error)).lower()}"
    else:
        text = f"a fault of the program: {type(error).__name__}: {error}"
    return " ".join(text.split())


def numbers_of(result: Result) -> dict[str, object]:
    """What the summary says of a result."""
    from photogonio.report.summary import numbers

    found = numbers(result)
    kept = ("model", "scale", "channels", "albedo", "relative_median", "valid", "photos_used")
    roughness = [lobe.mean_roughness for lobe in result.brdf.lobes]
    return {
        **{name: found[name] for name in kept},
        "error": _albedo_error(result),
        "roughness": min(roughness) if roughness else None,
        "warnings": sorted({one.code for one in result.diagnoses}),
        "left_out": len(result.left_out),
    }


def _albedo_error(result: Result) -> list[float] | None:
    """Standard error of the albedo, relative, a channel; None where it is not known."""
    from photogonio.report.budget import budget_numbers

    for one in budget_numbers(result.brdf):
        if one["of"] == "albedo":
            value, error = (np.asarray(one[name], float) for name in ("value", "standard_error"))
            return [float(e / v) for e, v in zip(error, value, strict=True)] if (value > 0.0).all() else None
    return None


def shared(workers: int, sets: int) -> tuple[int, int]:
    """How many sets at once, and with how many workers each."""
    at_once = max(1, min(workers, sets, int(_available() / EACH)))
    return at_once, max(1, workers // at_once)


def _available() -> float:
    """Bytes of memory that are free, where the system tells, or a scheduler such as SLURM allows; else as much as
    anybody wants."""
    return min(_free(), _allowed(Path("/sys/fs/cgroup")))


def _free() -> float:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    except OSError:
        pass
    return float("inf")


def _allowed(root: Path) -> float:
    """What the process's own control group, and those above it, leave (version 2)."""
    left = float("inf")
    try:
        lines = Path("/proc/self/cgroup").read_text().splitlines()
        own = next((line[3:].lstrip("/") for line in lines if line.startswith("0::")), "")
    except OSError:
        return left
    for folder in (root / own, *(root / own).parents):
        try:
            most = (folder / "memory.max").read_text().strip()
            if most != "max":
                left = min(left, float(most) - float((folder / "memory.current").read_text()))
        except (OSError, ValueError):
            continue
        if folder == root:
            break
    return left
