"""Photos as files: PNG and TIFF as they are; JPEG, HEIC and DNG as a telephone writes them, with EXIF."""

from __future__ import annotations

import math
import struct
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
import pillow_heif
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from photogonio.capture.files.stops import NAMES
from photogonio.synthetic.scene.parts import SensorScene
from photogonio.synthetic.scene.plan import FLASH, Shot
from photogonio.synthetic.write.dng import Entry, rational, short, write_dng

WITH_EXIF = ("jpeg", "heic", "dng")
CHROMA = {"4:2:0": (2, 420), "4:4:4": (0, 444)}  # as Pillow and as libheif call it
D50 = (0.96420, 1.0, 0.82491)
# X, Y, Z of red, green and blue, adapted to D50 (Bradford), as Apple's and the ICC's own profiles have them
PRIMARIES = {
    "srgb": ((0.43607, 0.22249, 0.01392), (0.38515, 0.71687, 0.09708), (0.14307, 0.06061, 0.71410)),
    "p3": ((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407)),
}
CALLED = {"srgb": "sRGB", "p3": "Display P3"}
SRGB_CURVE = (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)


def write_photo(path: Path, photo: np.ndarray, sensor: SensorScene, shot: Shot) -> None:
    """Writes ``photo`` (h, w, 3), uint8 or uint16, by the ending of ``path``. Raises OSError."""
    if sensor.format not in WITH_EXIF:
        settings = [cv2.IMWRITE_PNG_COMPRESSION, 1] if path.suffix == ".png" else []
        if not cv2.imwrite(str(path), photo[..., ::-1], settings):
            raise OSError(f"{path}: could not be written")
        return
    if sensor.format == "dng":
        write_dng(path, photo, round(sensor.black_level * 65535), dng_exif(sensor, shot))
        return
    picture, (pillow, heif) = Image.fromarray(photo), CHROMA[sensor.chroma]
    exif, profile = exif_of(sensor, shot), icc_profile(sensor)
    if sensor.format == "jpeg":
        picture.save(path, quality=sensor.quality, subsampling=pillow, exif=exif, icc_profile=profile)
        return
    picture.info["icc_profile"] = profile
    pillow_heif.from_pillow(picture).save(path, quality=sensor.quality, chroma=heif, exif=exif)


def exif_of(sensor: SensorScene, shot: Shot) -> bytes:
    """EXIF as a telephone has it: the time by its name, and whether its own lamp shone."""
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "photogonio", "synthetic phone"
    inner = exif.get_ifd(0x8769)
    inner[0x829A] = _ratio(named(sensor, shot.exposure_time))
    if sensor.f_number is not None:
        inner[0x829D] = _ratio(sensor.f_number)
    if sensor.iso is not None:
        inner[0x8827] = round(sensor.iso)
    inner[0x9209] = flash_of(shot)
    return exif.tobytes()


def dng_exif(sensor: SensorScene, shot: Shot) -> list[Entry]:
    """The same, as entries of a DNG's own directory."""
    found = [rational(0x829A, named(sensor, shot.exposure_time)), short(0x9209, flash_of(shot))]
    if sensor.f_number is not None:
        found.append(rational(0x829D, sensor.f_number))
    if sensor.iso is not None:
        found.append(short(0x8827, round(sensor.iso)))
    return found


def flash_of(shot: Shot) -> int:
    """EXIF's number: whether the camera's own lamp shone."""
    return 1 if any(lamp.id == FLASH for lamp in shot.lamps) else 16


def named(sensor: SensorScene, seconds: float) -> float:
    """Seconds as a file states them: 1/60 where a third of a stop is meant, 1/121 where the camera has no steps."""
    auto = sensor.exposure
    if auto is None:
        return seconds
    if auto.steps:
        names = NAMES["exposure_time"]
        return min(names, key=lambda name: abs(math.log(names[name] / seconds)))
    return 1.0 / round(1.0 / seconds) if seconds < 0.3 else round(seconds, 2)


def icc_profile(sensor: SensorScene) -> bytes:
    """A matrix profile (ICC.1:2010) of the file's primaries, with the curve that the file says it has: a telephone
    that bends its codes names the plain curve all the same."""
    numbers = {"linear": (1.0,), "gamma": (sensor.gamma,)}.get(sensor.encoding, SRGB_CURVE)
    kind = 3 if len(numbers) == 5 else 0
    curve = struct.pack(">4sIHH", b"para", 0, kind, 0) + b"".join(map(_fixed, numbers))
    red, green, blue = PRIMARIES[sensor.primaries]
    tags = {b"desc": _text(CALLED[sensor.primaries]), b"cprt": _text("public domain"), b"wtpt": _xyz(D50)}
    tags |= {b"rXYZ": _xyz(red), b"gXYZ": _xyz(green), b"bXYZ": _xyz(blue)}
    tags |= {name: curve for name in (b"rTRC", b"gTRC", b"bTRC")}
    place, table, data = 132 + 12 * len(tags), struct.pack(">I", len(tags)), b""
    for name, block in tags.items():
        block += bytes(-len(block) % 4)
        table += struct.pack(">4sII", name, place + len(data), len(block))
        data += block
    size = place + len(data)
    header = struct.pack(">I4sI4s4s4s", size, bytes(4), 0x04200000, b"mntr", b"RGB ", b"XYZ ")
    header += struct.pack(">6H4s", 2020, 1, 1, 0, 0, 0, b"acsp") + bytes(28)
    header += b"".join(map(_fixed, D50))
    return header.ljust(128, b"\0") + table + data


def _ratio(value: float) -> IFDRational:
    nearest = Fraction(value).limit_denominator(1_000_000)
    return IFDRational(nearest.numerator, nearest.denominator)


def _fixed(value: float) -> bytes:
    return struct.pack(">i", round(value * 65536))


def _xyz(values: tuple[float, ...]) -> bytes:
    return b"XYZ " + bytes(4) + b"".join(map(_fixed, values))


def _text(said: str) -> bytes:
    block = said.encode("utf-16-be")
    return struct.pack(">4sIII2s2sII", b"mluc", 0, 1, 12, b"en", b"US", len(block), 28) + block
