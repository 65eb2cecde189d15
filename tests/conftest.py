"""Tests keep no results in the user's cache, and find none there; linear algebra as the command line has it."""

import fcntl
import gc
import os
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest

import photogonio  # noqa: F401  sets the threads of linear algebra, before anything imports numpy
from photogonio.system.memory import collect_seldom, keep_freed

os.environ["PHOTOGONIO_CACHE"] = ""
keep_freed()
gc.disable()  # until all tests are collected: a fifth of that time went to looking through what never dies

Made = TypeVar("Made")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--long", action="store_true", help="all tests, those marked long too: twice the time")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves the long ones out unless asked for, or named."""
    if config.getoption("--long") or any("::" in word for word in config.args):
        return
    left_out = [one for one in items if one.get_closest_marker("long")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [one for one in items if not one.get_closest_marker("long")]


def pytest_collection_finish() -> None:
    """Circles are looked for as the command line has it."""
    collect_seldom()
    gc.enable()


def pytest_unconfigure() -> None:
    gc.unfreeze()  # libraries complain of what is left at the end


class Shared:
    """What several workers of one run use: who needs it first makes it, the others wait for it."""

    def __init__(self, folder: Path):
        self.folder = folder

    def once(self, name: str, make: Callable[[Path], Made]) -> Made:
        """What ``make`` gives, made once in the run; it may write to the folder that it is given."""
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        kept = folder / "made.pickle"
        with (folder / "lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not kept.is_file():
                kept.write_bytes(pickle.dumps(make(folder)))
        return pickle.loads(kept.read_bytes())


@pytest.fixture(scope="session")
def shared_by_workers(tmp_path_factory, worker_id) -> Shared:
    base = tmp_path_factory.getbasetemp()  # a folder in the run's, if there are workers
    return Shared((base if worker_id == "master" else base.parent) / "shared")
