"""Any BRDF from a file or a folder."""

from __future__ import annotations

from pathlib import Path

from photogonio.compare.reflectances import find_brdf, load_known
from photogonio.face.known import KnownBrdf
from photogonio.face.measured import MeasuredBrdf
from photogonio.reconstruct.brdf.brdf import Brdf


def load(path: str | Path) -> MeasuredBrdf | KnownBrdf:
    """A BRDF from the folder of a result, or from any file that holds one: coefficients of either version or
    SCATMECH's, a set's truth, MERL's ``.binary``, Mitsuba's ``.bsdf``, Radiance's ``.xml``, OpenPBR's ``.mtlx``,
    ``.gltf``, a grid or facet table (``.npz``), or a table of measured rows (``.csv``).

    Raises:
        InputError: no such file, or it holds none.
    """
    found = load_known(find_brdf(Path(path)))
    return MeasuredBrdf.of(found.evaluate) if isinstance(found.evaluate, Brdf) else KnownBrdf(found)
