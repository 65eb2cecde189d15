"""How do other programs read the result?

Takes Brdf; gives files of renderers and tables.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.csv_table import write_csv
from photogonio.reconstruct.export.merl_table import write_merl_table
from photogonio.reconstruct.export.mitsuba import write_mitsuba
from photogonio.reconstruct.export.modes_file import write_modes
from photogonio.reconstruct.export.scatmech_file import write_scatmech_file


class Writer(Protocol):
    """Writes a BRDF; says what is lost, if anything is."""

    def __call__(self, brdf: Brdf, path: Path, **asked: int) -> str | None: ...


@dataclass(frozen=True, slots=True)
class Format:
    suffix: str
    write: Writer
    ordered: bool = False  # whether it is told up to which order modes go


FORMATS = {
    "csv": Format(".csv", write_csv),
    "merl": Format(".binary", write_merl_table),
    "mitsuba": Format(".bsdf", write_mitsuba),
    "modes": Format(".json", write_modes, ordered=True),
    "scatmech": Format(".csv", write_scatmech_file, ordered=True),
}


def find_format(name: str) -> Format:
    """The format of that name.

    Raises:
        InputError: there is none.
    """
    if name not in FORMATS:
        raise InputError(f"--format {name}", f"expected one of {', '.join(FORMATS)}")
    return FORMATS[name]
