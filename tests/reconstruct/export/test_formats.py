"""Formats by name."""

from __future__ import annotations

import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.export.formats import find_format


def test_an_unknown_format_is_refused():
    with pytest.raises(InputError, match="csv, merl, mitsuba, radiance, openpbr, gltf, modes, scatmech"):
        find_format("obj")
