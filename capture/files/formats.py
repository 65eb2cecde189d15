"""Which format is a file? By its first bytes, whatever its name: no reader sees what is not promised.

Only between TIFF and the many camera RAW formats that are built on it does the name decide.
"""

from __future__ import annotations

from pathlib import Path

from photogonio.capture.containers.tiff import is_dng
from photogonio.capture.errors import InputError

HEAD = 4096  # bytes at a file's start that tell most files apart
RAW_SUFFIXES = {  # of the many that LibRaw opens, those that cameras write
    ".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dng", ".erf", ".fff", ".iiq", ".kdc", ".mef", ".mos", ".mrw",
    ".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2", ".rwl", ".sr2", ".srf", ".srw", ".x3f",
}  # fmt: skip
SUFFIXES = {  # of files that are taken for photos
    "png": {".png"},
    "tiff": {".tif", ".tiff"},
    "jpeg": {".jpg", ".jpeg", ".jpe", ".jfif"},
    "exr": {".exr"},
    "heif": {".heic", ".heif", ".hif"},
    "avif": {".avif"},
    "jxl": {".jxl"},
    "webp": {".webp"},
    "bmp": {".bmp", ".dib"},
    "raw": RAW_SUFFIXES,
}
NAMES = {
    "png": "PNG",
    "tiff": "TIFF",
    "jpeg": "JPEG",
    "exr": "OpenEXR",
    "heif": "HEIC",
    "avif": "AVIF",
    "jxl": "JPEG XL",
    "webp": "WebP",
    "bmp": "BMP",
    "raw": "camera RAW",
}
PROMISED = "PNG, TIFF, JPEG, OpenEXR, HEIC, AVIF, JPEG XL, WebP, BMP or camera RAW"
OTHERS = {  # formats that pictures come in and that are not read: named, not passed over
    ".gif": "GIF", ".jp2": "JPEG 2000", ".j2k": "JPEG 2000", ".jpx": "JPEG 2000", ".j2c": "JPEG 2000",
    ".psd": "Photoshop", ".psb": "Photoshop", ".xcf": "GIMP", ".hdr": "Radiance HDR", ".pfm": "PFM", ".pgm": "PGM",
    ".ppm": "PPM", ".pnm": "PNM", ".pbm": "PBM", ".tga": "Targa", ".dpx": "DPX", ".cin": "Cineon", ".fits": "FITS",
    ".fit": "FITS", ".fts": "FITS", ".jxr": "JPEG XR", ".wdp": "JPEG XR", ".insp": "Insta360", ".gpr": "GoPro RAW",
    ".raw": "raw", ".dcr": "Kodak RAW", ".bay": "Casio RAW", ".k25": "Kodak RAW", ".cap": "Phase One RAW",
    ".mdc": "Minolta RAW", ".r3d": "Red RAW", ".ktx": "KTX", ".dds": "DDS", ".rla": "RLA", ".iff": "IFF",
}  # fmt: skip
PLACED = (  # place, bytes, format
    (0, b"\x89PNG\r\n\x1a\n", "png"),
    (0, b"\xff\xd8\xff", "jpeg"),
    (0, b"\x76\x2f\x31\x01", "exr"),
    (0, b"BM", "bmp"),
    (0, b"\xff\x0a", "jxl"),
    (0, b"\0\0\0\x0cJXL \r\n\x87\n", "jxl"),
    (0, b"FUJIFILMCCD-RAW", "raw"),
    (0, b"IIU\0", "raw"),  # Panasonic, Leica
    (0, b"IIRO", "raw"),  # Olympus
    (0, b"IIRS", "raw"),
    (0, b"MMOR", "raw"),
    (0, b"FOVb", "raw"),  # Sigma
    (0, b"\0MRM", "raw"),  # Minolta
    (6, b"HEAPCCDR", "raw"),  # Canon CRW
    (0, b"IIII", "raw"),  # Phase One
    (0, b"MMMM", "raw"),
)
TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
BRANDS = {  # of ISO base media files
    b"crx ": "raw",  # Canon CR3
    b"avif": "avif", b"avis": "avif",
    b"heic": "heif", b"heix": "heif", b"heim": "heif", b"heis": "heif", b"hevc": "heif", b"hevx": "heif",
    b"mif1": "heif", b"msf1": "heif", b"heif": "heif",
}  # fmt: skip


def by_name(path: Path) -> str | None:
    """The format that a file's name promises; None if it names none of a photo's."""
    suffix = path.suffix.lower()
    return next((name for name, known in SUFFIXES.items() if suffix in known), None)


def format_of(path: Path) -> str:
    """The key in NAMES of the file's format. Raises InputError if it cannot be read or is of none of them."""
    if not in_unicode(path):  # no library for pictures opens it, and no manifest can say it
        raise InputError(path, "its name is not UTF-8; rename it")
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(path, "is no ordinary file: a pipe or a device, which photos are not read from")
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
            found = by_content(head)
            if found == "tiff" and (path.suffix.lower() in RAW_SUFFIXES or is_dng(file)):
                found = "raw"
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error
    if found is None:
        what = "empty file" if not head else f"not a readable image: its content is not {PROMISED}"
        raise InputError(path, what)
    return found


def in_unicode(path: Path) -> bool:
    """Whether a name is text: a file system may hold any bytes, and Python then makes lone surrogates of them."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        return False
    return True


def by_content(head: bytes) -> str | None:
    """The format of a file that begins with ``head``, camera RAW in a TIFF's clothes as TIFF; None if it is none of
    those promised."""
    for place, mark, name in PLACED:
        if head[place : place + len(mark)] == mark:
            return name
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return "webp"
    if head[4:8] == b"ftyp":
        return by_brand(head)
    return "tiff" if head[:4] in TIFF else None


def by_brand(head: bytes) -> str | None:
    """Of an ISO base media file: by its major brand, else by the first known compatible one."""
    size = min(int.from_bytes(head[:4], "big"), len(head))
    compatible = [head[k : k + 4] for k in range(16, size - 3, 4)]
    if head[8:12] in (b"mif1", b"msf1") and b"avif" in compatible:
        return "avif"
    known = [BRANDS[brand] for brand in (head[8:12], *compatible) if brand in BRANDS]
    return known[0] if known else None
