"""Scatter files in the manner of ASTM E1392 and E2387: keywords, then a line ``VARS`` with the names of columns.

The scattered direction is (theta_s, phi_s). The incident azimuth is that of the direction the light comes from, so
that azimuths are as ours. The standard has degrees; files with radians are asked about as any table is.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import chain, islice

LOOK = 200  # lines within which the columns are named
_VARS = re.compile(r"\s*VARS[\s:=]+(?=\S)", re.IGNORECASE)


def table_lines(lines: Iterable[str]) -> Iterator[str]:
    """The lines of a table, one for one: where a line names the columns, those before it are left blank."""
    rest = iter(lines)
    first = list(islice(rest, LOOK))
    place = next((k for k, line in enumerate(first) if _VARS.match(line)), None)
    if place is None:
        return chain(first, rest)
    header = re.sub(r"\b(theta|phi)_s\b", r"\1_r", _VARS.sub("", first[place], count=1))
    return chain(["\n"] * place, [header], first[place + 1 :], rest)
