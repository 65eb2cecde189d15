"""What each set says of its rig by itself, kept in a ledger of its own: a batch that was killed goes on from it."""

from __future__ import annotations

from photogonio.batch.ledger import DONE, FAILED, SetEntry
from photogonio.batch.work import Job, why
from photogonio.cache.running import job_in
from photogonio.cache.store import default_folder
from photogonio.capture.manifest.load import load_photoset
from photogonio.system.progress import Reporter

LEARNED = "rigs.jsonl"


def learned(job: Job) -> SetEntry:
    """Calibrate one set by itself: the marks of its rig, and what it says of it. A set that cannot be calibrated may
    have marks, and is told what others say."""
    # only here: who finds all sets done before, or gives them to others, need not wait for compiled code
    from photogonio.batch.rigs import marks_of
    from photogonio.cache.scratch import Scratch
    from photogonio.run.calibrate_photos import calibrated

    said: dict[str, object] = {}
    try:
        photoset = load_photoset(job.place.folder)
        said["marks"] = marks_of(photoset)
        with Scratch() as scratch, job_in(default_folder()):
            setup, *_ = calibrated(photoset, Reporter(quiet=True), job.options.threads(), scratch)
    except Exception as error:
        return SetEntry(job.place.name, job.key, FAILED, why(error, job), said)
    told = [{name: getattr(one, name) for name in one.__slots__} for one in setup.rig]
    return SetEntry(job.place.name, job.key, DONE, "", said | {"told": told})
