"""BRDFs in files of other programs: read, or refused by their own name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.merl import CHANNELS, is_merl, read_merl
from photogonio.reconstruct.brdf.mitsuba import read_mitsuba
from photogonio.reconstruct.brdf.radiance import read_radiance
from photogonio.reconstruct.brdf.scatmech import is_scatmech, read_scatmech, scatmech_brdf
from photogonio.reconstruct.brdf.schema import FORMAT
from photogonio.reconstruct.export.gltf import read_gltf
from photogonio.reconstruct.export.openpbr import read_openpbr
from photogonio.reconstruct.export.principled import Principled
from photogonio.reconstruct.goniometer.pabopto import beginning, is_pabopto, read_pabopto
from photogonio.reconstruct.goniometer.sampled import Evaluate, samples_of
from photogonio.reconstruct.goniometer.zemax import is_zemax, read_zemax, without_remarks
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

_SPEOS = "a surface file of Ansys Speos (OPTIS)"
_REFUSED = (  # what a file begins with, in whatever letters, and which program's it is
    ("OPTIS", _SPEOS),
    ("#OPTIS", _SPEOS),
    ("#?RADIANCE", "a file of Radiance's, but no BSDF XML; convert it with bsdf2ttree or bsdf2klems"),
    ("\x89HDF", "an HDF5 file"),
    ("SIMPLE  =", "a FITS file"),
    ("PK\x03\x04", "an archive or a spreadsheet; export the sheet as CSV"),
)
_MATERIALS: dict[str, tuple[str, Callable[[Path], Principled]]] = {
    ".mtlx": ("OpenPBR's material", read_openpbr),
    ".gltf": ("glTF's material", read_gltf),
}
_SPEOS_SUFFIXES = (".anisotropicbsdf", ".bsdf180", ".unpolished", ".simplescattering")
_LIGHTTOOLS = ("ScatterAzimuth", "ScatterRadial")
_ASK = "; export it as a text table with columns theta_i, phi_i, theta_r, phi_r and values"


@dataclass(frozen=True, slots=True)
class KnownEverywhere:
    """A BRDF that a file says for all directions."""

    channels: tuple[str, ...]
    isotropic: bool
    evaluate: Evaluate
    note: str


def known_everywhere(path: Path) -> KnownEverywhere | None:
    """MERL's binary, Radiance's XML, Mitsuba's tensor file, OpenPBR's and glTF's materials, SCATMECH's coefficients;
    None for other files.

    Raises:
        InputError: it is one of them, and cannot be read.
    """
    if path.is_file() and (path.suffix.lower() == ".binary" or is_merl(path)):
        return KnownEverywhere(CHANNELS, True, read_merl(path).evaluate, "MERL's table")
    if "<WindowElement" in beginning(path) or (path.suffix.lower() == ".xml" and path.is_file()):
        found = read_radiance(path)
        return KnownEverywhere(found.channels, found.isotropic, found.evaluate, f"BSDF XML, {found.note}")
    if beginning(path, 16).startswith("tensor_file"):
        known = read_mitsuba(path)
        return KnownEverywhere(known.channels, known.isotropic, known.evaluate, "Mitsuba's tensor file")
    if path.suffix in _MATERIALS and path.is_file():
        name, read = _MATERIALS[path.suffix]
        material = _principled(path, read)
        return KnownEverywhere(CHANNELS, material.anisotropy == 0.0, material, name)
    if path.is_file() and is_scatmech(path):
        return _of_coefficients(scatmech_brdf(read_scatmech(path)), "coefficients of SCATMECH's")
    return None


def of_coefficients(path: Path) -> KnownEverywhere | None:
    """A coefficient file of this program, whatever it is called; None for other files."""
    start = beginning(path)
    if not start.lstrip().startswith("{") or f'"{FORMAT}"' not in start:
        return None
    return _of_coefficients(load_brdf(path), "coefficients")


def _of_coefficients(brdf: Brdf, name: str) -> KnownEverywhere:
    return KnownEverywhere(brdf.channels, not brdf.turning, brdf, name)


def _principled(path: Path, read: Callable[[Path], Principled]) -> Principled:
    """A material of a renderer's own model, in R, G and B."""
    try:
        return read(path)
    except (
        ValueError,
        KeyError,
        IndexError,
        TypeError,
        AttributeError,
        ArithmeticError,
        SyntaxError,
    ) as error:
        raise InputError(path, f"holds no material that photogonio export wrote: {error}") from None


def read_foreign(path: Path) -> GoniometerSamples | None:
    """Samples of a file that is no text table; None where it may be one.

    Raises:
        InputError: it is of a kind that is not read, or cannot be read.
    """
    known = known_everywhere(path) or of_coefficients(path)
    if known is not None:
        return samples_of(
            lambda i, r: _above(known.evaluate, i, r),
            known.channels,
            isotropic=known.isotropic,
            note=known.note,
        )
    start = beginning(path)
    if path.is_dir() or is_pabopto(start):
        return read_pabopto(path)
    for mark, name in _REFUSED:
        if start[: len(mark)].upper() == mark.upper() or (
            name == _SPEOS and path.suffix.lower() in _SPEOS_SUFFIXES
        ):
            raise InputError(path, f"is {name}: not read{_ASK}")
    if path.suffix.lower() in (".json", ".yaml", ".yml"):
        raise InputError(path, f"is no coefficient file of this program, nor a table{_ASK}")
    if is_zemax(start) or is_zemax(without_remarks(path, start)):
        return read_zemax(path)
    if all(word in start for word in _LIGHTTOOLS):
        raise InputError(path, f"is a BSDF file of LightTools: not read{_ASK}")
    return None


def _above(evaluate: Evaluate, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    return np.asarray(evaluate(incident, exit), float).reshape(len(incident), -1)
