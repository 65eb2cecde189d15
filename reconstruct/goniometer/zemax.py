"""Zemax OpticStudio's tabular BSDF (Radiant's "BSDF data interchange file"): a text grid about the mirror direction.

A header names the angles in degrees; then, for each incident angle, a line with the total integrated scatter and a row
of values for each azimuth. The radial angle counts from the mirror direction; azimuth 0 points from there toward the
normal. Source: Rykowski, Zemax Tabular BSDF data file format.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.pabopto import beginning, text_of
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

_LISTS = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
_WORDS = ("Source", "Symmetry", "SpectralContent", "ScatterType")
_KEYWORDS = {word.lower(): word for word in (*_LISTS, *_WORDS)}  # in whatever letters
_SYMMETRIES = ("planesymmetrical", "asymmetrical", "asymmetrical4d")
_CHANNELS = {
    "monochrome": (("monochrome", "Y"),),
    "xyz": (("tristimulusx", "X"), ("tristimulusy", "Y"), ("tristimulusz", "Z")),
}
_TURN = 360.0
_NUDGE = 1e-6  # degrees between azimuths that are called the same
_GRAZING = 1e-3  # cosine of the exit angle below which a direction is in the surface or below it
_REMARKS = 1 << 20  # bytes of a file, within which its remarks end
_MOST = 20_000_000  # values: no such file is larger


def is_zemax(text: str) -> bool:
    """Whether a file that begins so is one."""
    return all(word in text.lower() for word in ("angleofincidence", "scatterazimuth"))


def without_remarks(path: Path, start: str) -> str:
    """What a file that has ``start`` says behind the remarks that it begins with; nothing of other files."""
    if not start.startswith("#"):
        return ""
    lines = beginning(path, _REMARKS).splitlines()
    return "\n".join(line for line in lines if not line.startswith("#"))[: len(start)]


def read_zemax(path: Path) -> GoniometerSamples:
    """Read the reflection of an isotropic surface; directions below the surface are passed over.

    Raises:
        InputError: the file is damaged, or of transmission, or of several rotations of the sample.
    """
    words = _Words.of(path)
    grid = _header(path, words)
    shape = len(grid.incident), len(grid.azimuth), len(grid.radial)
    value = np.stack([_block(path, words, mark, shape) for mark, _ in grid.channels], axis=-1)
    exit = _exits(grid)
    once = np.ones(shape, bool)
    once[:, 1:, grid.radial <= _NUDGE] = False  # the mirror direction has every azimuth
    once[:, np.abs(grid.azimuth - grid.azimuth[0] - _TURN) <= _NUDGE] = False
    keep = once & (exit[..., 2] > _GRAZING)
    if not keep.any():
        raise InputError(path, "holds no direction above the surface")
    theta_i = np.radians(np.broadcast_to(grid.incident[:, None, None], shape)[keep])
    theta_r, phi_r = spherical_angles(exit[keep])
    return GoniometerSamples(
        theta_i,
        np.zeros_like(theta_i),
        theta_r,
        phi_r,
        value=value[keep],
        sigma=None,
        channels=tuple(name for _, name in grid.channels),
        notes=(f"Zemax's tabular BSDF, {len(grid.incident)} incident angles",),
    )


@dataclass(frozen=True, slots=True)
class _Grid:
    """Angles in degrees."""

    incident: np.ndarray  # (i,)
    azimuth: np.ndarray  # (a,)
    radial: np.ndarray  # (r,)
    channels: tuple[tuple[str, str], ...]  # what marks the block of each, and its name


class _Words:
    """The words of a file without its remarks, one after another."""

    def __init__(self, path: Path, words: Iterator[str]):
        self._path, self._words = path, words

    @classmethod
    def of(cls, path: Path) -> _Words:
        text = text_of(path).splitlines()
        lines = (line.replace(",", " ") for line in text if not line.lstrip().startswith("#"))
        return cls(path, (word for line in lines for word in line.split()))

    def next(self, wanted: str) -> str:
        word = next(self._words, None)
        if word is None:
            raise InputError(self._path, f"ends before {wanted}")
        return word

    def numbers(self, count: int, wanted: str) -> np.ndarray:
        """(count,) of the next words."""
        words = [self.next(wanted) for _ in range(count)]
        try:
            found = np.array([float(word) for word in words])
        except ValueError:
            wrong = next(word for word in words if not _is_number(word))
            raise InputError(self._path, f"expected {count} numbers for {wanted}, found {wrong!r}") from None
        return found

    def count(self, wanted: str) -> int:
        word = self.next(f"how many there are of {wanted}")
        if not word.isdigit() or not 0 < int(word) <= _MOST:
            raise InputError(self._path, f"{wanted}: expected how many there are, found {word!r}")
        return int(word)


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _header(path: Path, words: _Words) -> _Grid:
    said: dict[str, str] = {}
    lists: dict[str, np.ndarray] = {}
    while len(lists) < len(_LISTS):
        found = words.next("ScatterRadial")
        word = _KEYWORDS.get(found.lower().rstrip(":"), found)
        if word in _WORDS:
            said[word] = words.next(word).lower()
        elif word in _LISTS:
            lists[word] = words.numbers(words.count(word), word)
        else:
            raise InputError(path, f"expected one of {', '.join((*_WORDS, *_LISTS))}, found {word!r}")
    _refuse(path, said, lists)
    kind = said.get("SpectralContent", "monochrome")
    if kind not in _CHANNELS:
        raise InputError(path, f"SpectralContent: expected Monochrome or XYZ, found {kind!r}")
    return _Grid(lists["AngleOfIncidence"], lists["ScatterAzimuth"], lists["ScatterRadial"], _CHANNELS[kind])


def _refuse(path: Path, said: dict[str, str], lists: dict[str, np.ndarray]) -> None:
    """Raises InputError for what is not read, and for angles that cannot be."""
    if said.get("ScatterType", "brdf") != "brdf":
        raise InputError(path, "is of transmission (ScatterType BTDF); only reflection is read")
    if said.get("Symmetry", _SYMMETRIES[0]) not in _SYMMETRIES:
        raise InputError(
            path, f"Symmetry: expected PlaneSymmetrical or Asymmetrical, found {said['Symmetry']!r}"
        )
    if len(lists["SampleRotation"]) > 1:
        raise InputError(path, "holds several rotations of the sample; only isotropic surfaces are read")
    limits = {
        "AngleOfIncidence": (0.0, 90.0),
        "ScatterAzimuth": (-_TURN, _TURN),
        "ScatterRadial": (0.0, 180.0),
    }
    for name, (least, most) in limits.items():
        if not ((lists[name] >= least) & (lists[name] <= most)).all():
            raise InputError(path, f"{name}: expected {least:g} to {most:g} degrees")
    if np.prod([float(len(one)) for one in lists.values()]) > _MOST:
        raise InputError(path, f"its angles ask for more than {_MOST} values")


def _block(path: Path, words: _Words, mark: str, shape: tuple[int, int, int]) -> np.ndarray:
    """Values (i, a, r) of one channel, 1/sr."""
    for wanted in (mark, "databegin"):
        word = words.next(wanted)
        if word.lower() == "dataend":
            word = words.next(wanted)
        if word.lower() != wanted:
            raise InputError(path, f"expected {wanted}, found {word!r}")
    found = []
    for k in range(shape[0]):
        if words.next("TIS").lower() != "tis":
            raise InputError(path, f"expected TIS before the values of the incident angle number {k + 1}")
        words.numbers(1, "TIS")
        found.append(words.numbers(shape[1] * shape[2], f"the incident angle number {k + 1}"))
    return np.reshape(found, shape)


def _exits(grid: _Grid) -> np.ndarray:
    """Unit vectors (i, a, r, 3); the light comes from azimuth 0."""
    azimuth, radial = np.radians(grid.azimuth)[:, None], np.radians(grid.radial)[None, :]
    down = np.sin(radial) * np.cos(azimuth)  # from the mirror direction toward the normal
    aside = np.sin(radial) * np.sin(azimuth)
    along = np.broadcast_to(np.cos(radial), down.shape)
    sine, cosine = (f(np.radians(grid.incident))[:, None, None] for f in (np.sin, np.cos))
    mirror = along * sine - down * cosine
    return np.stack([-mirror, np.broadcast_to(aside, mirror.shape), along * cosine + down * sine], axis=-1)
