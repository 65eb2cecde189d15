"""The formats by name: what writes each, what reads it as its consumer does, and what a written file loses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.merl import read_merl
from photogonio.reconstruct.brdf.mitsuba import read_mitsuba
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.export import principled
from photogonio.reconstruct.export.csv_table import write_csv
from photogonio.reconstruct.export.gltf import read_gltf, write_gltf
from photogonio.reconstruct.export.loss import PLACE, Evaluate, Loss, loss_of
from photogonio.reconstruct.export.merl_table import write_merl_table
from photogonio.reconstruct.export.mitsuba import wavelengths_of, write_mitsuba
from photogonio.reconstruct.export.modes_file import write_modes
from photogonio.reconstruct.export.openpbr import read_openpbr, write_openpbr
from photogonio.reconstruct.export.radiance_klems import write_radiance_klems
from photogonio.reconstruct.export.radiance_tree import write_radiance_tree
from photogonio.reconstruct.export.radiance_xml import gray
from photogonio.reconstruct.export.scatmech_file import write_scatmech_file

# writes a BRDF to a path, and what else is asked; says what is lost where the format's own reader is not asked
Writer = Callable[..., str | None]


@dataclass(frozen=True, slots=True)
class Format:
    suffix: str  # of a file that is given no name; no two formats share one, nor has any that of a result's own file
    write: Writer
    ordered: bool = False  # whether it is told up to which order modes go
    read: Callable[[Path], Evaluate] | None = (
        None  # as its consumer does; None: nothing is lost, or it is said
    )
    convert: Callable[[Brdf, np.ndarray], np.ndarray] | None = (
        None  # the source's channels (n, c) to the file's
    )
    room: bool = False  # the file says its loss itself

    def put(self, brdf: Any, path: Path, **asked: Any) -> tuple[str | None, Loss | None]:
        """Write a BRDF (or what is known as one is) to ``path``, with its loss in it where there is room; a remark, and
        the loss."""
        remark = self.write(brdf, path, **asked)
        loss = self.loss(brdf, path)
        if loss is not None and self.room:
            stated = path.read_bytes().replace(PLACE.encode(), f"photogonio: {loss}".encode(), 1)
            path.write_bytes(stated)
        return remark, loss

    def loss(self, brdf: Any, path: Path) -> Loss | None:
        """What the file at ``path``, written of ``brdf`` (or of what is known as one is), loses; None where it is not
        read back."""
        if self.read is None:
            return None
        change = self.convert
        return loss_of(brdf, self.read(path), None if change is None else lambda f: change(brdf, f))


def _gray(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    return gray(brdf, value)[:, None]


def _by_wavelength(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    waves = wavelengths_of(brdf.channels)
    return principled.rgb(brdf, value) if waves is None else value[:, np.argsort(waves)]


_RADIANCE: dict[str, Writer] = {"tree": write_radiance_tree, "klems": write_radiance_klems}
FORMATS = {
    "csv": Format(".csv", write_csv),
    "merl": Format(
        ".binary", write_merl_table, read=lambda path: read_merl(path).evaluate, convert=principled.rgb
    ),
    "mitsuba": Format(
        ".bsdf", write_mitsuba, read=lambda path: read_mitsuba(path).evaluate, convert=_by_wavelength
    ),
    "radiance": Format(
        ".xml", write_radiance_tree, read=lambda path: read_radiance(path).evaluate, convert=_gray, room=True
    ),
    "openpbr": Format(".mtlx", write_openpbr, read=read_openpbr, convert=principled.rgb, room=True),
    "gltf": Format(".gltf", write_gltf, read=read_gltf, convert=principled.rgb, room=True),
    "modes": Format(".modes.json", write_modes, ordered=True, read=load_brdf),
    "scatmech": Format(".scatmech.csv", write_scatmech_file, ordered=True),
}


def find_format(name: str, basis: str | None = None) -> Format:
    """The format of that name; of Radiance's, that basis.

    Raises:
        InputError: there is none.
    """
    if name not in FORMATS:
        raise InputError(f"--format {name}", f"expected one of {', '.join(FORMATS)}")
    if basis is None:
        return FORMATS[name]
    if name != "radiance":
        raise InputError(f"--basis {basis}", f"--format {name} has none; that is of --format radiance")
    return replace(FORMATS[name], write=_RADIANCE[basis])
