"""A picture of every photo with what calibration found drawn on it, beside the setup's file."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from photogonio.calib.report.overlay import draw_marks, mark_view, picture_of, white_of
from photogonio.calib.setup import Setup
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.manifest.draft import DRAWN
from photogonio.system.progress import Reporter

_QUALITY = 88


def pictures_folder(out: Path) -> Path:
    """Where the pictures of a setup file go: ``setup.json`` has them in ``setup-photos``."""
    return out.with_name(out.stem + DRAWN)


def save_pictures(radiance: RadianceReader, setup: Setup, folder: Path, reporter: Reporter) -> None:
    """One JPEG for each calibration and sample photo, named as the photo with ``-`` between its folders."""
    views = {v.name: v for role in ("calibration", "sample") for v in radiance.photoset.views(role)}
    boards = {board.name: board for board in setup.boards}
    samples = {view.name: view for view in setup.views}
    names = [name for name in views if name in boards or name in samples]
    for k, name in enumerate(names):
        white = white_of(radiance.read_level(views[name])[0])
        picture = np.concatenate([picture_of(band, white) for band in radiance.bands(views[name])])
        if name in samples:
            mark_view(picture, setup, samples[name])
        else:
            draw_marks(picture, boards[name].marks)
        (folder / picture_name(name)).write_bytes(_jpeg(picture))
        reporter.progress("drawing what was found", k + 1, len(names))


def picture_name(photo: str) -> str:
    """A photo's picture's file name: that of ``sample/s00.png`` is ``sample-s00.png.jpg``."""
    return photo.replace("/", "-") + ".jpg"


def _jpeg(picture: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
