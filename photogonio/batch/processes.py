"""Sets worked on several at a time: one whose process dies costs no other its result."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence

from photogonio.batch.ledger import FAILED, SetEntry
from photogonio.batch.work import Job, processed
from photogonio.system.memory import collect_seldom, keep_freed
from photogonio.system.processes import ProcessDied, as_done


def in_processes(
    jobs: Sequence[Job], workers: int, work: Callable[[Job], SetEntry] = processed
) -> Generator[SetEntry, None, None]:
    """The entries of jobs as they are done, ``workers`` at a time. Sets that are under way when a process dies are
    tried once more, each alone: so it is known whose fault it was."""
    left, suspects = {job.place.name: job for job in jobs}, list[str]()
    while left:
        alone = bool(suspects)
        chosen = [left[suspects.pop()]] if alone else list(left.values())
        died: list[str] = []
        try:
            for _, entry in as_done(work, chosen, 1 if alone else workers, _begin):
                del left[entry.set]
                yield entry
        except ProcessDied as error:
            died = sorted((chosen[place].place.name for place in error.under_way), reverse=True)
        if alone and died:
            job = left.pop(died[0])
            yield SetEntry(
                job.place.name, job.key, FAILED, "its process died, twice: is there memory enough?"
            )
        elif died:
            suspects = died


def _begin() -> None:
    keep_freed()
    collect_seldom()
