"""The formats by name: what writes each, what reads it as its consumer does, and what a written file loses."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.mitsuba import read_mitsuba
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.brdf.scatmech import read_scatmech, scatmech_brdf
from photogonio.reconstruct.export import principled
from photogonio.reconstruct.export.csv_table import read_csv, write_csv
from photogonio.reconstruct.export.gltf import read_gltf, write_gltf
from photogonio.reconstruct.export.loss import PLACE, Evaluate, Loss, loss_of
from photogonio.reconstruct.export.merl_table import NearestBins, write_merl_table
from photogonio.reconstruct.export.mitsuba import remark_mitsuba, wavelengths_of, write_mitsuba
from photogonio.reconstruct.export.modes_file import write_modes
from photogonio.reconstruct.export.openpbr import read_openpbr, write_openpbr
from photogonio.reconstruct.export.pabopto_files import in_xyz, read_pabopto_files, write_pabopto
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
    read: Callable[[Path], Evaluate]  # as its consumer does
    ordered: bool = False  # whether it is told up to which order modes go
    convert: Callable[[Brdf, np.ndarray], np.ndarray] | None = (
        None  # the source's channels (n, c) to the file's
    )
    state: Callable[[Path, str], None] | None = None  # says the loss in the file; None: it has no room
    folder: bool = False  # of files
    gathered: bool = False  # whether its model is no reciprocal one: albedos are of light toward the viewer

    def put(self, brdf: Any, path: Path, *, source: str = "", **asked: Any) -> tuple[str | None, Loss]:
        """Write a BRDF (or what is known as one is) to ``path``; where there is room its loss and ``source``, where it
        came from, are in it. A remark, and the loss."""
        remark = self.write(brdf, path, **asked)
        loss = self.loss(brdf, path)
        if self.state is not None:
            self.state(path, f"photogonio: {loss}" + (f"; {source}" if source else ""))
        return remark, loss

    def loss(self, brdf: Any, path: Path) -> Loss:
        """What the file at ``path``, written of ``brdf`` (or of what is known as one is), loses."""
        change = self.convert
        convert = None if change is None else lambda f: change(brdf, f)
        return loss_of(brdf, self.read(path), convert, gathered=self.gathered)


def _gray(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    return gray(brdf, value)[:, None]


def _by_wavelength(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    waves = wavelengths_of(brdf.channels)
    return principled.rgb(brdf, value) if waves is None else value[:, np.argsort(waves)]


def _in_plain_text(path: Path, text: str) -> None:
    for file in sorted(path.iterdir()) if path.is_dir() else [path]:
        _fill(file, text)


def _in_xml(path: Path, text: str) -> None:
    _fill(path, escape(text.replace("--", "- -")))  # two hyphens would end the remark


def _in_json(path: Path, text: str) -> None:
    _fill(path, json.dumps(text)[1:-1])


def _fill(path: Path, text: str) -> None:
    path.write_bytes(path.read_bytes().replace(PLACE.encode(), text.encode(), 1))


def _read_scatmech(path: Path) -> Evaluate:
    return scatmech_brdf(read_scatmech(path))


_RADIANCE: dict[str, Writer] = {"tree": write_radiance_tree, "klems": write_radiance_klems}
FORMATS = {
    "csv": Format(".csv", write_csv, read_csv, state=_in_plain_text),
    "merl": Format(".binary", write_merl_table, NearestBins, convert=principled.rgb),
    "mitsuba": Format(
        ".bsdf",
        write_mitsuba,
        lambda path: read_mitsuba(path).evaluate,
        convert=_by_wavelength,
        state=remark_mitsuba,
    ),
    "radiance": Format(
        ".xml", write_radiance_tree, lambda path: read_radiance(path).evaluate, convert=_gray, state=_in_xml
    ),
    "openpbr": Format(
        ".mtlx", write_openpbr, read_openpbr, convert=principled.rgb, state=_in_xml, gathered=True
    ),
    "gltf": Format(".gltf", write_gltf, read_gltf, convert=principled.rgb, state=_in_json),
    "modes": Format(".modes.json", write_modes, load_brdf, ordered=True, state=_in_json),
    "scatmech": Format(".scatmech.csv", write_scatmech_file, _read_scatmech, ordered=True),
    "pabopto": Format(
        ".pabopto", write_pabopto, read_pabopto_files, convert=in_xyz, state=_in_plain_text, folder=True
    ),
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
