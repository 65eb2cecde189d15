"""What is chosen for photos where the user did not ask: the symmetry to reduce for, the facets' level."""

from __future__ import annotations

import math

from photogonio.calib.setup import Setup
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header
from photogonio.capture.photoset import PhotoSet, Plane, Sphere
from photogonio.options import Choice, Options
from photogonio.reconstruct.model_choice import FitOptions, refuse_order
from photogonio.reconstruct.reduce.directions import region_of
from photogonio.run.tables import refuse_channels

LEVELS = (1, 4)  # that "auto" chooses among
_HIGHEST = 6  # facets of 0.8 degrees; finer ones have hardly a pixel each
_CELL_PIXELS = 2  # on the mean; a finer level would leave most cells with an edge pixel or two
_CELLS = 17.5  # about, that one photo of a ball fills at level 0; four times as many a level
_MOST_CELLS = 2e6  # of all photos, to fit in memory and in seconds


def asked_symmetry(photoset: PhotoSet, options: Options) -> str:
    """The symmetry to reduce for: the command's, else the manifest's.

    Raises:
        InputError: something other than isotropic was asked of a sphere.
    """
    return symmetry_of(options, photoset.symmetry, photoset.sample)


def symmetry_of(options: Options, told: str, sample: Sphere | Plane) -> str:
    """The symmetry to fit: the command's, else what is ``told`` of the sample.

    Raises:
        InputError: something other than isotropic was asked of a sphere.
    """
    symmetry = options.symmetry if options.symmetry != "auto" else told
    if not isinstance(sample, Sphere):
        return symmetry
    if symmetry not in ("auto", "isotropic"):
        raise InputError(f"--symmetry {symmetry}", "a sphere is always reduced as an isotropic sample")
    return "isotropic"


def refuse_asked(photoset: PhotoSet, symmetry: str, options: Options) -> None:
    """What a fit of these photos to that ``symmetry`` cannot do, before anything is done; by the manifest, the options,
    and what the first photo of the sample that can be read says of itself.

    Raises:
        InputError: a level or an order beyond those there are, or channels that photos have not.
    """
    if options.level is not None:
        refuse_level(options.level)
    # of "auto" the symmetry is not known yet: what is too high for every one
    refuse_order(FitOptions(order=options.order), "isotropic" if symmetry == "auto" else symmetry)
    if options.channels is not None:
        channels = _channels_told(photoset)
        refuse_channels(options.channels, channels or options.channels)


def refuse_level(level: int) -> None:
    """Raises InputError for a level beyond what facets can do."""
    if not 1 <= level <= _HIGHEST:
        raise InputError(f"--level {level}", f"expected a level from 1 to {_HIGHEST}")


def _channels_told(photoset: PhotoSet) -> tuple[str, ...]:
    """By the header of the first photo of the sample that can be read; none if there is no such."""
    demosaic = photoset.radiometry.demosaic
    for view in photoset.views("sample"):
        for photo in view.photos:
            try:
                return read_header(photoset.folder / photo.file, demosaic=demosaic).channels
            except (InputError, OSError):
                continue
    return ()


def choose_level(setup: Setup, options: Options) -> Choice:
    """The facets' level: as asked, else the finest whose cells hold a few pixels of a photo each.

    Raises:
        InputError: a level beyond what facets can do.
    """
    if options.level is not None:
        refuse_level(options.level)
        return Choice("facet level", str(options.level), "asked for")
    pixels = sorted(_sample_pixels(setup))[len(setup.views) // 2]
    by_pixels = _finest(pixels / _CELL_PIXELS)
    level = min(by_pixels, _finest(_MOST_CELLS / len(setup.views)))
    reason = (
        f"facets of {51.2 / 2**level:.1f} degrees suit about {_round(pixels)} pixels of the sample a photo"
    )
    if level < by_pixels:
        reason = f"facets of {51.2 / 2**level:.1f} degrees keep the table of {len(setup.views)} photos small"
    return Choice("facet level", str(level), reason)


def _finest(cells: float) -> int:
    """The finest level, of those that auto takes, at which one photo fills at most so many cells."""
    finest = int(math.log(max(cells / _CELLS, 1.0), 4))
    return min(max(finest, LEVELS[0]), LEVELS[1])


def _sample_pixels(setup: Setup) -> list[float]:
    """About how many pixels the sample covers in each view."""
    boxes = [region_of(setup, view.pose) for view in setup.views]
    return [math.pi / 4 * max(right - left, 0) * max(bottom - top, 0) for left, top, right, bottom in boxes]


def _round(value: float) -> str:
    digits = max(0, int(math.log10(max(value, 1.0))) - 1)
    return f"{round(value, -digits):,.0f}"
