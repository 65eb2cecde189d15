"""Compiled code that numba keeps beside the program: it must be that of today's text, and damage is no error.

Numba knows a function's code by the time and size of its own file, and takes what it calls in other files, the
constants it reads there and the fields of tuples it is given for what they were: after an update it may run old code.
So the key of what is kept has all of these. An index that was damaged, or that names classes which a later version of
the program has renamed, ends every run with a traceback (numba 0.61 to 0.68): what cannot be read is compiled again.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterator
from functools import partial
from types import CodeType, FunctionType, ModuleType
from typing import Any

from numba.core.caching import Cache, IndexDataCacheFile

_CONSTANTS = (bool, int, float, complex, str, bytes, tuple, set, frozenset, dict, type(None))

# what unpickling foreign bytes may raise: pickle names some and says that there are more, and what the bytes call has
# its own
UNREADABLE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    ImportError,
    LookupError,
    MemoryError,
    NameError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    pickle.PickleError,
)


def keep_fresh() -> None:
    """Let numba take what it cannot read of its cache as absent, and what is of other code. Asked for by
    :mod:`capture.jit`, of which every loop comes: so no process that works for another can forget it."""
    _wrap(IndexDataCacheFile, "_load_index", partial(_forgiving, dict))
    _wrap(IndexDataCacheFile, "load", partial(_forgiving, lambda: None))
    _wrap(Cache, "_index_key", _with_code)


def _wrap(owner: type, name: str, wrapper: Callable[[Callable[..., Any]], Callable[..., Any]]) -> None:
    """Once, where there is such a method."""
    inner = getattr(owner, name, None)
    if inner is not None and not hasattr(inner, "photogonio"):
        outer = wrapper(inner)
        outer.photogonio = True  # type: ignore[attr-defined]
        setattr(owner, name, outer)


def _forgiving(absent: Callable[[], Any], inner: Callable[..., Any]) -> Callable[..., Any]:
    def outer(*arguments: Any) -> Any:
        try:
            return inner(*arguments)
        except UNREADABLE:
            return absent()

    return outer


def _with_code(inner: Callable[..., Any]) -> Callable[..., Any]:
    def outer(cache: Any, signature: Any, codegen: Any) -> tuple[object, ...]:
        fields = repr([getattr(one, "fields", None) for one in signature])
        return (*inner(cache, signature, codegen), code_of(cache._py_func), fields)

    return outer


def code_of(function: FunctionType) -> str:
    """A hash of a function's code and of all compiled functions, constants and types that it names."""
    whole, seen = hashlib.sha256(), set()
    waiting: list[object] = [function]
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        inner = getattr(one, "py_func", one)
        if isinstance(inner, FunctionType):
            whole.update(_plain(getattr(one, "targetoptions", {})).encode())
            for code in _codes(inner.__code__):
                whole.update(code.co_code + repr((code.co_names, code.co_varnames)).encode())
                waiting += [value for value in code.co_consts if not isinstance(value, CodeType)]
            waiting += _named(inner)
        else:
            whole.update(_told(inner))
    return whole.hexdigest()


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A function's code and that of functions within it."""
    yield code
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield from _codes(value)


def _named(function: FunctionType) -> list[object]:
    """What a function names of its module and of functions around it."""
    names = sorted({name for code in _codes(function.__code__) for name in code.co_names})
    found = [function.__globals__[name] for name in names if name in function.__globals__]
    for cell in function.__closure__ or ():
        try:
            found.append(cell.cell_contents)
        except ValueError:  # not filled yet
            continue
    return found


def _told(value: object) -> bytes:
    if isinstance(value, _CONSTANTS):
        return _plain(value).encode()
    if hasattr(value, "tobytes"):
        return repr((value.shape, value.dtype)).encode() + value.tobytes()  # type: ignore[attr-defined]
    if isinstance(value, ModuleType):
        return value.__name__.encode()
    name = getattr(value, "__qualname__", type(value).__qualname__)
    return repr((name, getattr(value, "_fields", None))).encode()


def _plain(value: object) -> str:
    """As text, the same in every process: sets of words have another order in each."""
    if isinstance(value, dict):
        return repr(sorted((_plain(key), _plain(one)) for key, one in value.items()))
    if isinstance(value, set | frozenset):
        return repr(sorted(map(_plain, value)))
    return repr(value)
