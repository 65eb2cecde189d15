"""The black level that a DNG states where LibRaw does not hand it over whole (DNG 1.7.1, BlackLevel).

LibRaw cuts fractions off, takes the mean of what rows and columns add, and keeps to itself what repeats otherwise than
by 2 x 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.capture.containers import tiff

BY_LIBRAW = {(1, 1), (2, 2)}  # repeats, of whole numbers


@dataclass(frozen=True, slots=True)
class Black:
    """File units; rows and columns are the file's own."""

    cells: np.ndarray  # (rows, columns, planes), repeated from the active area's first pixel
    across: np.ndarray  # (width,) added to each column of the active area; empty: nothing
    down: np.ndarray  # (height,) to each row
    origin: tuple[int, int]  # of the active area: row, column

    @property
    def mean(self) -> float:
        added = [float(part.mean()) for part in (self.across, self.down) if part.size]
        return float(self.cells.mean()) + sum(added)

    def at(self, rows: np.ndarray, columns: np.ndarray, plane: int = 0) -> np.ndarray:
        """(rows, columns) float32."""
        y, x = rows - self.origin[0], columns - self.origin[1]
        layer = self.cells[..., min(plane, self.cells.shape[2] - 1)]
        found = layer[np.ix_(y % layer.shape[0], x % layer.shape[1])]
        if self.down.size:
            found = found + self.down[np.clip(y, 0, len(self.down) - 1)][:, None]
        if self.across.size:
            found = found + self.across[np.clip(x, 0, len(self.across) - 1)]
        return found.astype(np.float32)


def black_of(tags: tiff.Tags, *, always: bool = False) -> Black | None:
    """Of a picture's directory; None where LibRaw has it whole (unless ``always``), and where it is damaged."""
    levels, across, down = (
        ratios(tags.get(tag, ())) for tag in (tiff.BLACK, tiff.BLACK_ACROSS, tiff.BLACK_DOWN)
    )
    planes = tags.get(tiff.SAMPLES, (1,))[0]
    repeat = tags.get(tiff.BLACK_REPEAT, (1, 1)) if levels.size else (1, 1)
    levels = levels if levels.size else np.zeros(planes)
    whole = bool((levels == np.round(levels)).all()) and repeat in BY_LIBRAW
    if whole and not across.any() and not down.any() and not always:
        return None
    sound = all(np.isfinite(part).all() for part in (levels, across, down))
    if not sound or len(repeat) != 2 or levels.size != repeat[0] * repeat[1] * planes or not levels.size:
        return None
    top, left = (*tags.get(tiff.ACTIVE, (0, 0)), 0, 0)[:2]
    return Black(levels.reshape(*repeat, planes), across, down, (top, left))


def black_fault(tags: tiff.Tags) -> str:
    """Why the levels that a picture's directory states cannot be what is to be taken off; empty where they can."""
    levels, across, down = (
        ratios(tags.get(tag, ())) for tag in (tiff.BLACK, tiff.BLACK_ACROSS, tiff.BLACK_DOWN)
    )
    planes, repeat = tags.get(tiff.SAMPLES, (1,))[0], tags.get(tiff.BLACK_REPEAT, (1, 1))
    if not all(np.isfinite(part).all() for part in (levels, across, down)):
        return "a black level that is no number"
    fits = len(repeat) == 2 and levels.size == repeat[0] * repeat[1] * planes
    if levels.size and not fits and not (levels.size == 1 and repeat == (1, 1)):
        cells = " x ".join(map(str, repeat))
        return f"{levels.size} black levels for cells of {cells} and {planes} colours"
    return ""


def ratios(pairs: tuple[int, ...]) -> np.ndarray:
    """(n,) of numerators and denominators in turn."""
    above, below = np.array(pairs[::2], float), np.array(pairs[1::2], float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return above / below
