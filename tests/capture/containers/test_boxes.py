"""The boxes of HEIC files: how a viewer turns the picture."""

from __future__ import annotations

import struct

import pillow_heif
import pytest

from photogonio.capture.containers.boxes import boxes, child, turns
from tests.capture.dng_files import HEIGHT, WIDTH
from tests.capture.phone_files import heic, near, smooth


def with_turns(data: bytes, *properties: bytes) -> bytes:
    """A HEIC file whose main picture has further properties (their boxes)."""
    added = b"".join(properties)
    ipco = data.index(b"ipco") - 4
    ipma = data.index(b"ipma") - 4
    (size,) = struct.unpack_from(">I", data, ipco)
    number = sum(1 for _ in boxes(data, ipco + 8, ipco + size))
    (ipma_size,) = struct.unpack_from(">I", data, ipma)
    assert struct.unpack_from(">II", data, ipma + 8) == (0, 1)  # one item
    body = bytearray(
        data[ipma : ipma + ipma_size] + bytes(0x80 | (number + 1 + k) for k in range(len(properties)))
    )
    body[18] += len(properties)
    struct.pack_into(">I", body, 0, len(body))
    grown = len(added) + len(properties)
    new = bytearray(data[: ipco + size] + added + data[ipco + size : ipma] + body + data[ipma + ipma_size :])
    struct.pack_into(">I", new, ipco, size + len(added))
    for name in (b"meta", b"iprp"):
        place = data.index(name) - 4
        struct.pack_into(">I", new, place, struct.unpack_from(">I", new, place)[0] + grown)
    iloc = data.index(b"iloc")
    offsets = [
        place for place in range(iloc, iloc + 60) if data[place : place + 4] == struct.pack(">I", media(data))
    ]
    assert offsets
    for place in offsets:
        struct.pack_into(">I", new, place, media(data) + grown)
    return bytes(new)


def media(data: bytes) -> int:
    return data.index(b"mdat") + 4


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("mirror", [None, 0, 1])
def test_a_heic_that_a_viewer_turns_is_read_as_its_sensor_saw_it(tmp_path, quarters, mirror):
    path = heic(tmp_path / "a.heic", smooth())
    turns = [struct.pack(">I4sB", 9, b"irot", quarters)]
    turns += [] if mirror is None else [struct.pack(">I4sB", 9, b"imir", mirror)]
    path.write_bytes(with_turns(path.read_bytes(), *turns))
    shown = pillow_heif.open_heif(str(path))
    assert shown.size == (
        (WIDTH, HEIGHT) if quarters % 2 == 0 else (HEIGHT, WIDTH)
    )  # what viewers make of it
    assert near(path, smooth(), 3)


def box(kind: bytes, content: bytes, *, wide: bool = False) -> bytes:
    if wide:
        return struct.pack(">I4sQ", 1, kind, 16 + len(content)) + content
    return struct.pack(">I4s", 8 + len(content), kind) + content


def test_boxes_of_every_size_follow_one_another():
    """Sizes of 32 and of 64 bits; one of 0 goes to the end."""
    data = (
        box(b"ftyp", b"mif1")
        + box(b"meta", box(b"pitm", b"12345"), wide=True)
        + struct.pack(">I4s", 0, b"mdat")
        + b"xyz"
    )
    found = [(kind, data[start:end]) for kind, start, end in boxes(data)]
    assert found == [(b"ftyp", b"mif1"), (b"meta", box(b"pitm", b"12345")), (b"mdat", b"xyz")]
    inside = child(data, b"meta", (0, len(data)))
    assert data[slice(*child(data, b"pitm", inside))] == b"12345" and child(data, b"iprp", inside) is None


def test_a_box_that_claims_too_much_or_too_little_ends_the_walk():
    good = box(b"ftyp", b"mif1")
    for size in (0x7FFFFFFF, 7, 2):
        damaged = good + struct.pack(">I4s", size, b"meta") + bytes(20)
        assert [kind for kind, _, _ in boxes(damaged)] == [b"ftyp"]
    assert turns(good) == turns(b"") == []
    for length in range(len(good)):
        assert list(boxes(good[:length])) == []
