"""Compiled code that numba keeps beside the program: what of it cannot be read is compiled again.

An index that was damaged, or that names classes which a later version of the program has renamed, else ends every run
with a traceback (numba 0.61 to 0.66).
"""

from __future__ import annotations

import sys


def forgive_damage() -> None:
    """Let numba, if it was imported, take what it cannot read of its cache as absent."""
    if "numba" not in sys.modules:
        return
    from numba.core.caching import IndexDataCacheFile as Kept

    for name, absent in (("_load_index", dict), ("load", lambda: None)):
        inner = getattr(Kept, name, None)
        if inner is not None and not hasattr(inner, "forgiving"):
            setattr(Kept, name, _forgiving(inner, absent))


def _forgiving(inner, absent):
    def outer(*arguments):
        try:
            return inner(*arguments)
        except Exception:  # whatever unpickling foreign bytes may raise
            return absent()

    outer.forgiving = True
    return outer
