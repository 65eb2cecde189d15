"""The tone curves of an ICC profile (ICC.1:2022).

Of profiles for a monitor or for gray: their curves are what undoes the codes. Profiles that know only many-dimensional
tables have none.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from photogonio.capture.containers.tone import Curve, Tone, named, of_cicp, rises

HEAD, ENTRY = 128, 12  # bytes
MOST_TAGS, MOST_STEPS = 1000, 1 << 16
CHANNELS = {b"RGB ": (b"rTRC", b"gTRC", b"bTRC"), b"GRAY": (b"kTRC",)}
# of each function type of a parametric curve: how many numbers it has, and they as g, a, b, c, d, e, f
PARAMETRIC: dict[int, tuple[int, Callable[..., tuple[float, ...]]]] = {
    0: (1, lambda g: (g, 1, 0, 0, 0, 0, 0)),
    1: (3, lambda g, a, b: (g, a, b, 0, -b / a, 0, 0)),
    2: (4, lambda g, a, b, c: (g, a, b, 0, -b / a, c, c)),
    3: (5, lambda g, a, b, c, d: (g, a, b, c, d, 0, 0)),
    4: (7, lambda *numbers: numbers),
}


def tone_of(profile: bytes) -> Tone:
    """The profile's curves. Raises ValueError, saying why, if it has none that can be read."""
    try:
        return _tone(profile)
    except (struct.error, ZeroDivisionError, UnicodeDecodeError, IndexError) as error:
        raise ValueError("ICC profile is damaged") from error
    except ValueError as error:
        raise ValueError(f"ICC profile {str(error).removeprefix('ICC profile ')}") from error


def _tone(profile: bytes) -> Tone:
    if len(profile) < HEAD + 4 or profile[36:40] != b"acsp":
        raise ValueError("is damaged")
    tags = tags_of(profile)
    source = f'ICC profile "{description(tags.get(b"desc", b""))}"'
    if tags.get(b"cicp", b"")[:4] == b"cicp":
        told = of_cicp(tags[b"cicp"][9], source)
        if told is not None:
            return told
    space = profile[16:20]
    if space not in CHANNELS:
        raise ValueError(f"is of {space.decode('latin-1').strip()} colours")
    if not all(name in tags for name in CHANNELS[space]):
        raise ValueError("has no tone curve, only tables of colours")
    curves = [curve(tags[name]) for name in CHANNELS[space]]
    if not all(rises(one) for one in curves):
        raise ValueError("has a tone curve that does not rise")
    curves = [named(one) for one in curves]
    return Tone(tuple(curves[:1] if len(set(curves)) == 1 else curves), source)


def tags_of(profile: bytes) -> Mapping[bytes, bytes]:
    (count,) = struct.unpack_from(">I", profile, HEAD)
    found = {}
    for k in range(min(count, MOST_TAGS)):
        name, place, size = struct.unpack_from(">4sII", profile, HEAD + 4 + k * ENTRY)
        found[name] = profile[place : place + size]
    return found


def curve(tag: bytes) -> Curve:
    """Of a ``curv`` or ``para`` tag."""
    kind, number = struct.unpack_from(">4s4xH", tag)
    if kind == b"para":
        if number not in PARAMETRIC:
            raise ValueError(f"has a parametric curve of the unknown type {number}")
        count, ordered = PARAMETRIC[number]
        numbers = [value / 65536 for value in struct.unpack_from(f">{count}i", tag, 12)]
        return (
            Curve("gamma", tuple(numbers)) if number == 0 else Curve("parametric", tuple(ordered(*numbers)))
        )
    if kind != b"curv":
        raise ValueError("has a tone curve of an unknown type")
    (count,) = struct.unpack_from(">I", tag, 8)
    if count == 0:
        return Curve("linear")
    if count > MOST_STEPS:
        raise ValueError(f"has a tone curve of {count} steps")
    if count == 1:
        return Curve("gamma", (struct.unpack_from(">H", tag, 12)[0] / 256,))
    return Curve("table", tuple(value / 65535 for value in struct.unpack_from(f">{count}H", tag, 12)))


def description(tag: bytes) -> str:
    """The profile's name, of a ``desc`` tag of either version."""
    if tag[:4] == b"desc":
        (length,) = struct.unpack_from(">I", tag, 8)
        text = tag[12 : 12 + length].decode("latin-1")
    elif tag[:4] == b"mluc":
        length, place = struct.unpack_from(">II", tag, 20)
        text = tag[place : place + length].decode("utf-16-be", errors="replace")
    else:
        text = ""
    shown = " ".join("".join(letter for letter in text if letter.isprintable()).split())
    return shown[:60] or "without a name"
