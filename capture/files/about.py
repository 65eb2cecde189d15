"""What a photo's file says of itself, and how it is to be read: one look at its header for each format."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from photogonio.capture.containers import exif, icc, jpeg, jxl, png, tiff
from photogonio.capture.containers.png import APART
from photogonio.capture.containers.tone import Curve, Tone, difference, named, of_cicp, of_exif, rises, untold
from photogonio.capture.errors import InputError
from photogonio.capture.files import decode, exr, heif

BITS = {"uint8": 8, "uint16": 16}
MIRRORED = {2, 4, 5, 7}  # of EXIF's orientations
# how to undo what a decoder made of an orientation: quarter turns anticlockwise, after a flip of left and right
UNDONE = {
    1: (0, False),
    2: (0, True),
    3: (2, False),
    4: (2, True),
    5: (3, True),
    6: (1, False),
    7: (1, True),
    8: (3, False),
}
EMPTY: Mapping[str, object] = {}
MOST_TIMES = 16  # as long as its pixels reach a picture may be
MOST_GAMMA = 5.0
EDGES = 0.02  # of a picture's pixels, along the soft edges of what is cut out
OF_FOUR = ("R", "G", "B", "A")


@dataclass(frozen=True, slots=True)
class About:
    size: tuple[int, int]  # width, height as stored
    channels: tuple[str, ...]
    bits: int  # of an integer code, at whose full scale it counts as 1; 0: floats
    tone: Tone
    attributes: dict[str, object] = field(default_factory=dict)  # EXIF's, by OpenImageIO's names
    notes: tuple[str, ...] = ()  # how it is read, where that is not plain
    doubts: tuple[str, ...] = ()  # what a person should look at
    lossy: bool = False
    reader: str = "oiio"  # or "opencv", "heic", "avif"
    part: int = 0  # of several in the file
    kept: tuple[int, ...] = ()  # its channels; empty: all
    inverted: bool = False  # the code 0 is white
    corner: tuple[int, int] | None = (
        None  # x, y of the first pixel in the picture, where it is not all that is stored
    )
    turned: int = 1  # the orientation that the decoder applies, in EXIF's numbers

    def as_stored(self, pixels: np.ndarray) -> np.ndarray:
        """Decoded pixels without what the decoder should have left alone or should have done."""
        if self.corner is not None:
            pixels = placed(pixels, self.corner, self.size)
        if self.inverted:
            pixels = np.array((1 << self.bits) - 1, pixels.dtype) - pixels
        quarters, flipped = UNDONE[self.turned]
        pixels = np.rot90(pixels, quarters)
        return np.ascontiguousarray(pixels[:, ::-1] if flipped else pixels)


def placed(pixels: np.ndarray, corner: tuple[int, int], size: tuple[int, int]) -> np.ndarray:
    """A picture of ``size`` (width, height) with pixels from ``corner`` (x, y) on; what lies outside is cut off, and
    nothing is black."""
    (x, y), (width, height) = corner, size
    whole = np.zeros((height, width, pixels.shape[2]), pixels.dtype)
    left, top = max(x, 0), max(y, 0)
    part = pixels[top - y : max(height - y, 0), left - x : max(width - x, 0)]
    whole[top : top + part.shape[0], left : left + part.shape[1]] = part
    return whole


def about(path: Path, kind: str, data: bytes | None = None) -> About:
    """Of a file of a format other than camera RAW, of which ``data`` are the bytes, where they are at hand. Raises
    InputError if it cannot be read."""
    try:
        found = of_png(path, data) if kind == "png" else READERS.get(kind, plain)(path)
    except ValueError as error:
        raise error if isinstance(error, InputError) else InputError(path, str(error)) from error
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error
    orientation = found.attributes.get("Orientation", 1)
    if orientation in MIRRORED:
        note = (
            f"says that it is mirrored (orientation {orientation}); its pixels are taken as they are stored"
        )
        found = replace(found, doubts=(*found.doubts, note))
    return with_gamma(found)


def with_gamma(found: About) -> About:
    """With EXIF's Gamma: what tells the curve where nothing else does, else a witness."""
    gamma = found.attributes.get("Exif:Gamma")
    curve = Curve("gamma", (gamma,)) if isinstance(gamma, float) and 0.0 < gamma < MOST_GAMMA else None
    if curve is None or not rises(curve) or max(difference(curve, one) for one in found.tone.curves) <= APART:
        return found
    tone = Tone((named(curve),), "EXIF Gamma")
    if not found.tone.told:
        return replace(found, tone=tone)
    taken = f"{found.tone.name} by its {found.tone.source}"
    note = f"says {taken} and {tone.name} by its {tone.source}; the first is taken"
    return replace(found, doubts=(*found.doubts, note))


def of_spec(
    path: Path,
    spec: oiio.ImageSpec,
    more: Mapping[str, object] = EMPTY,
    *,
    tell: Callable[[], Tone | None] | None = None,
    lossy: bool = False,
) -> About:
    """As OpenImageIO sees it, with ``more`` attributes. ``tell`` finds the tone curve, else they do."""
    attributes = {**decode.attributes_of(spec), **more}
    bits = BITS.get(str(spec.format), 0)
    kept = tuple(k for k in range(spec.nchannels) if k not in (spec.alpha_channel, spec.z_channel))
    channels = tuple(spec.channelnames[k] for k in kept)
    tone, doubts = tone_or_doubt(tell or (lambda: tone_of(attributes)), bits, len(channels), lossy=lossy)
    return About((spec.width, spec.height), channels, bits, tone, attributes, (), doubts, lossy, kept=kept)


def tone_of(attributes: dict[str, object]) -> Tone | None:
    """Of OpenImageIO's attributes."""
    code, profile = attributes.get("CICP"), attributes.get("ICCProfile")
    told = of_cicp(int(code[1]), "CICP") if isinstance(code, tuple) and len(code) > 1 else None
    if told is not None:
        return told
    if profile is not None:
        return icc.tone_of(np.asarray(profile, np.uint8).tobytes())
    return of_exif(attributes.get("Exif:ColorSpace"), attributes.get("Exif:InteroperabilityIndex"))


def tone_or_doubt(
    tell: Callable[[], Tone | None], bits: int, channels: int, *, lossy: bool
) -> tuple[Tone, tuple[str, ...]]:
    """What ``tell`` finds, or what is taken where it finds nothing, and what there is to say of it."""
    taken = untold(bits=bits, lossy=lossy)
    try:
        told = tell()
    except ValueError as error:
        return taken, (f"its {error}; its codes are taken as {taken.name}",)
    if told is not None and len(told.curves) not in (1, channels):
        what = f"its {told.source} is of {len(told.curves)} channels, the picture has {channels}"
        return taken, (f"{what}; its codes are taken as {taken.name}",)
    return told or taken, ()


def plain(path: Path) -> About:
    """Formats in which there is nothing to choose."""
    with decode.open_oiio(path) as file:
        return of_spec(path, file.spec())


def of_png(path: Path, data: bytes | None) -> About:
    with decode.open_oiio(path) as file:
        spec = file.spec()
        told = png.about(path, data)
        more = exif.attributes(told.get(png.EXIF, b""))  # which OpenImageIO does not see behind the pixels
        found = of_spec(path, spec, more, tell=lambda: png.tone_of(told))
        doubts = (*found.doubts, *png.contradiction(told, found.tone))
        return replace(found, reader="opencv" if spec.nchannels in (1, 3) else "oiio", doubts=doubts)


def of_jpeg(path: Path) -> About:
    told = jpeg.about(path)
    with decode.open_oiio(path) as file:
        more = exif.attributes(told.exif)  # of which OpenImageIO leaves out the interoperability index
        found = of_spec(path, file.spec(), more, lossy=True)
    names = ("R", "G", "B") if told.components == 3 else ("Y",)
    notes = ("holds a gain map (Ultra HDR): its base picture is read",) if told.gain_map else ()
    return replace(found, size=told.size, bits=8, channels=names, kept=(), notes=notes)


def of_tiff(path: Path) -> About:
    page = tiff.picture_of(path)
    with decode.open_oiio(path, page.index) as file:
        spec = file.spec()
        found = replace(of_spec(path, spec, tell=lambda: tone_of_tiff(page, spec)), part=page.index)
        # of five channels and more, none can be meant as a mask, whatever the fourth is marked as
        if spec.nchannels > len(OF_FOUR):
            found = replace(found, kept=(), channels=tuple(spec.channelnames))
        if page.photometric == tiff.MIN_IS_WHITE and found.bits == 16:  # of 8 bits, OpenImageIO does it
            found = replace(found, inverted=True)
        if page.photometric == tiff.MIN_IS_WHITE and found.bits == 0:
            raise InputError(
                path, "holds floats of which the least is white; expected them to grow with light"
            )
        if page.photometric == tiff.PALETTE and page.samples > 1:
            raise InputError(path, f"holds a palette of {page.samples} samples a pixel; expected one")
        if page.samples == len(OF_FOUR) and page.photometric == tiff.RGB and not page.extra:
            found = fourth_untold(path, file, found)
        if tiff.MULTIPLIED in page.extra and found.kept and spec.alpha_channel >= 0:
            refuse_veiled(path, file, found.part, spec.alpha_channel)
        simple = not page.planar and page.index == 0 and page.orientation == 1
        # of 8 bits, OpenCV fills what is damaged and says nothing
        fits = spec.nchannels == page.samples == tiff.PLAIN.get(page.photometric)
        fits = fits and found.bits == page.bits == 16
        return replace(found, reader="opencv" if simple and fits else "oiio")


def tone_of_tiff(page: tiff.Page, spec: oiio.ImageSpec) -> Tone | None:
    """By its profile, its table of codes, or EXIF."""
    attributes = decode.attributes_of(spec)
    profile = attributes.get("ICCProfile")
    return (None if profile is not None else tiff.tone_of(page)) or tone_of(attributes)


def fourth_untold(path: Path, file: oiio.ImageInput, found: About) -> About:
    """Of an RGB picture with a fourth sample of which the file does not say what it is: opaque all over it is a mask,
    else light."""
    fourth = decode.decode_oiio(path, file, found.part, (3,))
    opaque = np.iinfo(fourth.dtype).max if fourth.dtype.kind == "u" else 1.0
    if bool((fourth == opaque).all()):
        return found
    return replace(found, kept=(), channels=("R", "G", "B", "channel3"))


def refuse_veiled(path: Path, file: oiio.ImageInput, part: int, alpha: int) -> None:
    """Of a picture whose colours are multiplied by an alpha, as the file says. Where that is 0 or 1 they are cut out
    or as they were; in between they are no light that a camera saw."""
    mask = decode.decode_oiio(path, file, part, (alpha,))
    opaque = np.iinfo(mask.dtype).max if mask.dtype.kind == "u" else 1.0
    veiled = float(np.mean((mask > 0) & (mask < opaque)))
    if veiled > EDGES:
        what = f"has its colours multiplied by an alpha that is neither 0 nor 1 in {veiled:.0%} of its pixels"
        raise ValueError(f"{what}; expected an opaque picture")


def of_exr(path: Path) -> About:
    with decode.open_oiio(path) as file:
        part, kept = exr.picture_of(file)
        file.seek_subimage(part, 0)
        spec = file.spec()
        found = of_spec(path, spec, tell=lambda: exr.tone_of(spec))
        found = replace(found, part=part, kept=kept, channels=tuple(spec.channelnames[k] for k in kept))
        corner, size = (spec.x - spec.full_x, spec.y - spec.full_y), (spec.full_width, spec.full_height)
        if corner == (0, 0) and size == found.size:
            return found
        if not all(-own < at < whole for at, own, whole in zip(corner, found.size, size, strict=True)):
            raise ValueError("has its pixels outside its display window, all of them")
        if max(size) > MOST_TIMES * max(found.size):
            raise ValueError(f"has pixels for {found.size} of a picture of {size}")
        return replace(
            found, size=size, corner=corner
        )  # the display window is what a camera's matrix speaks of


def of_jxl(path: Path) -> About:
    attributes, turned = jxl.about(path)
    with decode.open_oiio(path) as file:
        found = of_spec(path, file.spec(), attributes, lossy=True)
    width, height = found.size
    return replace(found, size=(height, width) if turned > 4 else (width, height), turned=turned)


def of_webp(path: Path) -> About:
    with decode.open_oiio(path) as file:
        return of_spec(path, file.spec(), lossy=True)


def of_heif(path: Path) -> About:
    return _of_heif(path, "heic")


def of_avif(path: Path) -> About:
    return _of_heif(path, "avif")


def _of_heif(path: Path, reader: str) -> About:
    file = heif.opened(path)
    attributes = heif.attributes_of(file)
    channels = heif.channels_of(file)
    bits = int(file.info.get("bit_depth", 8))

    def tell() -> Tone | None:
        return heif.tone_of(file) or of_exif(
            attributes.get("Exif:ColorSpace"), attributes.get("Exif:InteroperabilityIndex")
        )

    tone, doubts = tone_or_doubt(tell, bits, len(channels), lossy=True)
    notes = ("holds a gain map (HDR): its base picture is read",) if heif.has_gain_map(file) else ()
    size = heif.size_of(path, file)
    return About(size, channels, bits, tone, attributes, notes, doubts, lossy=True, reader=reader)


READERS: dict[str, Callable[[Path], About]] = {
    "jpeg": of_jpeg,
    "tiff": of_tiff,
    "exr": of_exr,
    "jxl": of_jxl,
    "webp": of_webp,
    "heif": of_heif,
    "avif": of_avif,
}
