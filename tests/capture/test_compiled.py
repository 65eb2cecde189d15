"""What numba keeps beside the program is that of today's text; what it cannot read is compiled again."""

import sys
from importlib import import_module, invalidate_caches
from pathlib import Path

import numba
import pytest

from photogonio.capture.compiled import code_of, keep_fresh

KERNEL = """
import numba
from compiled_callee import FACTOR, twice

@numba.njit(cache=True)
def scaled(x):
    return FACTOR * twice(x)

@numba.njit(cache=True)
def first(pair):
    return pair.a
"""
CALLEE = """
from typing import NamedTuple
import numba

FACTOR = {factor}

class {pair}(NamedTuple):
    {fields[0]}: float
    {fields[1]}: float

@numba.njit(cache=True)
def twice(x):
    return {by} * x
"""
MODULES = ("compiled_callee", "compiled_kernel")


class Program:
    """Two modules, of which one calls the other, and numba's cache beside them."""

    def __init__(self, folder: Path):
        self.folder = folder

    def run(self, *, factor=1.0, by=2.0, pair="Pair", fields=("a", "b")) -> tuple[float, float]:
        """As a new process would, after an update of the callee."""
        (self.folder / "compiled_callee.py").write_text(
            CALLEE.format(factor=factor, by=by, pair=pair, fields=fields)
        )
        for name in MODULES:
            sys.modules.pop(name, None)
        invalidate_caches()
        callee, kernel = (import_module(name) for name in MODULES)
        self.kernel = kernel
        return kernel.scaled(3.0), kernel.first(getattr(callee, pair)(5.0, 7.0))


@pytest.fixture
def program(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    (tmp_path / "compiled_kernel.py").write_text(KERNEL)
    keep_fresh()
    keep_fresh()  # once is enough
    yield Program(tmp_path)
    for name in MODULES:
        sys.modules.pop(name, None)


def test_a_damaged_index_or_code_is_compiled_again(program):
    assert program.run() == (6.0, 5.0)
    for suffix in ("nbi", "nbc"):
        kept = list((program.folder / "cache").rglob(f"*.{suffix}"))
        assert kept
        for one in kept:
            one.write_bytes(one.read_bytes()[:-20])
        assert program.run() == (6.0, 5.0)


def test_code_that_calls_what_has_changed_is_compiled_again(program):
    assert program.run() == (6.0, 5.0)
    assert program.run() == (6.0, 5.0)
    assert program.kernel.scaled.stats.cache_hits  # kept where nothing changed
    assert program.run(by=3.0) == (9.0, 5.0)
    assert program.run(factor=10.0) == (60.0, 5.0)


def test_tuples_whose_fields_changed_places_or_names_are_compiled_for_anew(program):
    assert program.run() == (6.0, 5.0)
    assert program.run(fields=("b", "a")) == (6.0, 7.0)
    assert program.run(pair="Renamed") == (6.0, 5.0)  # the index names a class that is no more


def test_the_code_is_that_of_all_that_is_called(program):
    program.run()
    before = code_of(program.kernel.scaled.py_func)
    assert code_of(program.kernel.scaled.py_func) == before
    program.run(by=3.0)
    assert code_of(program.kernel.scaled.py_func) != before
