"""What stands on the board, and which photos show it: cells that hide the print in most of several photos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.identify.covered import Cover

SMALLEST = 60  # cells of what is hidden, to be a sample
BARE = 0.02  # share of the board that is hidden below which nothing stands on it
SOME = (
    0.3  # of the largest share that any photo hides: those that hide less may show something else, or nothing
)
BLACK = 0.8  # of the photos in which a place is dark: no shadow, which would move


@dataclass(frozen=True, slots=True)
class Thing:
    """Something on the board beside the sample."""

    corners: np.ndarray  # (4, 2) of the narrowest box about what it hides of the board


def hiding(covers: Sequence[Cover]) -> np.ndarray:
    """Cells (h, w) uint8, 1 where the print is hidden in most photos.

    What is black in all photos is no shadow, which would move."""
    hidden = sum((c.hidden == 1).astype(float) for c in covers)
    seen = sum((c.hidden == 0).astype(float) for c in covers)
    shape = covers[0].shape
    mask = (((hidden > seen) & (hidden > 0)) | _black(covers)).reshape(shape).astype(np.uint8)
    mask = cv2.morphologyEx(mask, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
    unknown = ((hidden == 0) & (seen == 0)).reshape(shape)
    closed = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((9, 9), np.uint8)) > 0
    return np.where(unknown & closed, 1, mask).astype(np.uint8)


def _black(covers: Sequence[Cover]) -> np.ndarray:
    dark = sum(c.dark.astype(float) for c in covers)
    seen = sum((c.hidden == 0).astype(float) for c in covers)
    return np.asarray((dark >= BLACK * len(covers)) & (seen == 0))


def main_part(covers: Sequence[Cover]) -> np.ndarray | None:
    """Cells (h, w) bool of the largest connected part that hides the print; None if there is none."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(hiding(covers), connectivity=8)
    if count < 2:
        return None
    best = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    return labels == best if stats[best, cv2.CC_STAT_AREA] >= SMALLEST else None


def showing(covers: Sequence[Cover]) -> list[bool]:
    """Which photos show the sample, the largest thing that stands on the board: they hide more of its cells than they
    show. Balls and patches may stay where they are in photos of the board."""
    shares = np.array([c.share for c in covers])
    chosen = (shares >= BARE) & (shares >= SOME * shares.max(initial=0.0))
    for _ in range(2):
        main = main_part([c for c, one in zip(covers, chosen, strict=True) if one]) if chosen.any() else None
        if main is None:
            return [bool(share >= BARE) for share in shares]
        chosen = np.array([_shows(c, main.ravel()) for c in covers])
    return [bool(one) for one in chosen]


def _shows(cover: Cover, main: np.ndarray) -> bool:
    hidden, seen = int((cover.hidden[main] == 1).sum()), int((cover.hidden[main] == 0).sum())
    return hidden > seen if hidden or seen else cover.share >= BARE


def things(covers: Sequence[Cover]) -> list[Thing]:
    """What stands on the board beside the sample, the largest first."""
    mask, main = hiding(covers), main_part(covers)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    found = []
    for k in sorted(range(1, count), key=lambda k: -stats[k, cv2.CC_STAT_AREA]):
        own = labels == k
        if stats[k, cv2.CC_STAT_AREA] < SMALLEST or (main is not None and (own & main).any()):
            continue
        (x, y), (width, height), turn = cv2.minAreaRect(covers[0].points[own.ravel()].astype(np.float32))
        step = covers[0].step  # cells are as wide about their middles
        corners = cv2.boxPoints(((x, y), (width + step, height + step), turn))
        found.append(Thing(np.asarray(corners, float)))
    return found
