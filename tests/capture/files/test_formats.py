"""Which format a file is of: its first bytes tell, not its name."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from photogonio.capture.errors import InputError
from photogonio.capture.files import formats
from photogonio.capture.files.formats import format_of
from photogonio.capture.files.images import read_image
from tests.capture.phone_files import near, smooth


def test_the_content_counts_and_not_the_name(tmp_path):
    Image.fromarray(smooth()).save(tmp_path / "a.png")
    (tmp_path / "a.png").rename(tmp_path / "a.exr")
    assert near(tmp_path / "a.exr", smooth(), 0)
    for content in (b"GIF89a" + bytes(40), b"P6 2 2 255\n" + bytes(12), b"8BPS" + bytes(30), b"#?RADIANCE\n"):
        for name in ("b.png", "b.tif", "b.exr", "b.dng", "b.heic"):
            (tmp_path / name).write_bytes(content)
            with pytest.raises(InputError, match="its content is not PNG"):
                read_image(tmp_path / name)


def test_every_format_has_a_name_an_ending_and_is_promised():
    assert formats.NAMES.keys() == formats.SUFFIXES.keys()
    *first, last = formats.NAMES.values()
    assert ", ".join(first) + " or " + last == formats.PROMISED
    every = [suffix for known in (*formats.SUFFIXES.values(), formats.OTHERS) for suffix in known]
    assert len(every) == len(set(every))  # no ending is of two formats
    for kind, known in formats.SUFFIXES.items():
        for suffix in known:
            assert formats.by_name(Path(f"A{suffix.upper()}")) == kind and suffix == suffix.lower()


def test_no_formats_first_bytes_are_anothers():
    for place, mark, kind in formats.PLACED:
        assert formats.by_content(bytes(place) + mark + bytes(40)) == kind
        assert formats.by_content((bytes(place) + mark)[:-1]) != kind or len(mark) == 1


@pytest.mark.parametrize(
    ("major", "compatible", "kind"),
    [
        (b"heic", [], "heif"),
        (b"avif", [b"mif1"], "avif"),
        (b"mif1", [b"heic"], "heif"),
        (b"mif1", [b"miaf", b"avif"], "avif"),
        (b"crx ", [b"isom"], "raw"),
        (b"abcd", [b"isom", b"heix"], "heif"),
        (b"isom", [b"mp41"], None),
    ],
)
def test_brands_of_boxed_files(major, compatible, kind):
    """ISO/IEC 14496-12, 4.3: a major brand, its version, then what else readers may take it for."""
    size = 16 + 4 * len(compatible)
    head = size.to_bytes(4, "big") + b"ftyp" + major + bytes(4) + b"".join(compatible)
    assert formats.by_content(head + b"heic") == kind  # what follows the box is no brand


def test_of_tiffs_own_bytes_the_name_tells_camera_raw(tmp_path):
    for name, kind in (("a.tif", "tiff"), ("a.NEF", "raw"), ("a", "tiff")):
        (tmp_path / name).write_bytes(b"II*\0" + bytes(8))
        assert format_of(tmp_path / name) == kind
    (tmp_path / "b.png").write_bytes(b"")
    with pytest.raises(InputError, match=r"b\.png: empty file"):
        format_of(tmp_path / "b.png")
    with pytest.raises(InputError, match=r"c\.png: cannot be read"):
        format_of(tmp_path / "c.png")


def test_a_name_that_is_no_text_is_refused(tmp_path):
    with pytest.raises(InputError, match="not UTF-8"):
        format_of(tmp_path / "photo\udcff.png")
