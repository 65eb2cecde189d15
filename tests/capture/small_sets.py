"""Small photo sets, and the light in them."""

from __future__ import annotations

SHAPE = (60, 80)
STEP16 = 1 / 65535


def value(photoset, reader, number=0, roi=None):
    return reader.read(photoset.views("sample")[number], roi).value
