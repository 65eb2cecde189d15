"""pab-opto's files of measured scattering: one file an incident direction, rows of theta, phi and values."""

from __future__ import annotations

import codecs
from pathlib import Path

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

_MARKS = ("#intheta", "#incident_angle", "#theta_in", "#format: theta phi", "#format:\ttheta\tphi")
_CHANNELS = {"cie-xyz": ("X", "Y", "Z"), "cie-y": ("Y",)}
GRAZING = 0.02  # cosine of the exit angle, by which a DSF is not divided any more


def is_pabopto(text: str) -> bool:
    """Whether a file that begins so is one."""
    low = text.lower()
    return text.startswith("#") and any(mark in low for mark in _MARKS)


def read_pabopto(path: Path) -> GoniometerSamples:
    """Read one file, or all of a folder. Reflection only: rows and files of the other side are left out.

    Raises:
        InputError: a file is of another kind, or says no incident direction, or there is none.
    """
    if path.is_dir():
        files = sorted(file for file in path.iterdir() if file.is_file() and is_pabopto(beginning(file)))
        suffixes = {file.suffix for file in files}
        others = sorted(
            f.name for f in path.iterdir() if f.is_file() and f.suffix in suffixes and f not in files
        )
    else:
        files, others = [path], []
    if not files:
        raise InputError(
            path, "holds no pab-opto file; expected headers with #intheta and #format: theta phi"
        )
    parts = [_rows(file) for file in files]
    channels = parts[0][1]
    for file, (_, names) in zip(files, parts, strict=True):
        if names != channels:
            raise InputError(file, f"has channels {', '.join(names)}, others {', '.join(channels)}")
    rows = np.vstack([part for part, _ in parts])
    keep = np.isfinite(rows).all(1) & (rows[:, 0] < 90.0) & (rows[:, 2] < 90.0)
    if not keep.any():
        raise InputError(path, "no row is of reflection, with both directions above the surface")
    angles = np.radians(rows[keep, :4]).T
    lost = int((~keep).sum())
    message = f"{lost} rows left out: transmission, or without a number"
    told: tuple[Diagnosis, ...] = (Diagnosis("rows-left-out", message, amount=lost),) if lost else ()
    told += tuple(
        Diagnosis("rows-left-out", f"{name} has none of pab-opto's headers, and is not read", amount=1)
        for name in others
    )
    note = (f"pab-opto, {len(files)} incident directions",)
    theta_i, phi_i, theta_r, phi_r = angles
    return GoniometerSamples(
        theta_i,
        phi_i,
        theta_r,
        phi_r,
        value=rows[keep, 4:],
        sigma=None,
        channels=channels,
        left_out=lost,
        diagnoses=told,
        notes=note,
    )


def beginning(path: Path, size: int = 4096) -> str:
    """The first characters of a file, whatever they are, without a mark of byte order; nothing where it cannot be
    read, or is no file."""
    if not path.is_file():
        return ""
    try:
        with path.open("rb") as file:
            start = file.read(size)
    except OSError:
        return ""
    return start.decode(marked(start), "ignore").removeprefix("\ufeff")


def marked(start: bytes) -> str:
    """The encoding of a file that has ``start``, by its mark of byte order; Latin-1, which any bytes are, without."""
    if start.startswith(codecs.BOM_UTF8):
        return "utf-8-sig"
    return "utf-16" if start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "latin-1"


def text_of(path: Path) -> str:
    """The whole file.

    Raises:
        InputError: it cannot be read.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from None
    return data.decode(marked(data), "replace")


def _rows(path: Path) -> tuple[np.ndarray, tuple[str, ...]]:
    """Rows (n, 4 + c): theta_i, phi_i, theta_r, phi_r in degrees and values in 1/sr."""
    lines = text_of(path).splitlines()
    header = [line[1:].strip() for line in lines if line.startswith("#")]
    said: dict[str, str] = {}
    for line in header:
        name, _, rest = line.replace("\t", " ").partition(" ")
        said.setdefault(name.lower().rstrip(":"), rest.strip())
    *order, kind = said.get("format", "").lower().split() or ["theta", "phi", "bsdf"]
    if kind not in ("bsdf", "brdf", "dsf") or order not in (["theta", "phi"], ["phi", "theta"]):
        raise InputError(path, f"its format is {said.get('format')!r}; expected theta phi and DSF or BSDF")
    theta, phi = _incidence(path, said)
    channels = _CHANNELS.get(said.get("colorimetry", "").lower(), ("Y",))
    try:
        data = np.loadtxt([line for line in lines if line.strip() and not line.startswith("#")], ndmin=2)
    except ValueError as error:
        raise InputError(path, f"rows are not numbers ({' '.join(str(error).split())[:80]})") from None
    if data.shape[1] != 2 + len(channels):
        raise InputError(path, f"has {data.shape[1]} columns; expected theta, phi and {len(channels)}")
    if order[0] == "phi":
        data[:, :2] = data[:, 1::-1].copy()
    value = data[:, 2:]
    if kind == "dsf":
        cosine = np.cos(np.radians(data[:, :1]))
        value = np.divide(value, cosine, out=np.full_like(value, np.nan), where=cosine > GRAZING)
    incident = np.broadcast_to([theta, phi], (len(data), 2))
    return np.hstack([incident, data[:, :2], value]), channels


def _incidence(path: Path, said: dict[str, str]) -> tuple[float, float]:
    try:
        if "incident_angle" in said:
            theta, phi, *unit = said["incident_angle"].split()
        else:
            theta, *unit = (said.get("intheta") or said["theta_in"]).split()
            phi, *more = (said.get("inphi") or said.get("phi_in") or "0").split()
            unit += more
        incident = float(theta), float(phi)
    except (KeyError, ValueError):
        raise InputError(path, "says no incident direction (#intheta and #inphi)") from None
    if any(word.lower().startswith(("rad", "gon", "grad")) for word in unit):
        raise InputError(
            path, f"its incident direction is in {unit[0]}; expected degrees, as pab-opto has them"
        )
    return incident
