#!/usr/bin/env bash
# rawpy 0.28.0 (LibRaw 0.22.2): a DNG of floats that is deflated without a predictor (Compression 8, Predictor 1 or absent, which
# TIFF says is 1) is decoded as if it had the floating point predictor 3: noise from end to end, no error, no warning.
#
# The same floats uncompressed, or deflated with Predictor 3, come out right. A merged HDR mosaic written by one's own script
# (any TIFF library deflates so by default) turns to garbage that still has a plausible size, levels and range.
#
# Output seen (share of 4096 pixels that come out within 0.1 % of full scale of what was written):
#   uncompressed        : 1.000
#   deflate, predictor 3: 1.000
#   deflate, predictor 1: 0.000
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rawpy==0.28.0 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import struct
import zlib

import numpy as np
import rawpy

SIDE = 64
floats = np.random.default_rng(0).uniform(0.05, 0.95, (SIDE, SIDE)).astype("<f4")
floats[0, 0] = 1.0  # LibRaw scales by the brightest: here the white level


def rational(*values):
    return b"".join(struct.pack("<ii", int(value * 1000), 1000) for value in values)


def write(path, content, compression, predictor):
    """A baseline DNG 1.4: one strip, a mosaic of red, green, green, blue."""
    def tags(place):
        return [
            (254, 4, struct.pack("<I", 0)), (256, 4, struct.pack("<I", SIDE)), (257, 4, struct.pack("<I", SIDE)),
            (258, 3, struct.pack("<H", 32)), (259, 3, struct.pack("<H", compression)), (262, 3, struct.pack("<H", 32803)),
            (271, 2, b"Maker\0"), (272, 2, b"Model\0"), (273, 4, struct.pack("<I", place)), (277, 3, struct.pack("<H", 1)),
            (278, 4, struct.pack("<I", SIDE)), (279, 4, struct.pack("<I", len(content))), (284, 3, struct.pack("<H", 1)),
            (317, 3, struct.pack("<H", predictor)), (339, 3, struct.pack("<H", 3)), (33421, 3, struct.pack("<HH", 2, 2)),
            (33422, 1, bytes([0, 1, 1, 2])), (50706, 1, bytes([1, 4, 0, 0])), (50708, 2, b"Maker Model\0"),
            (50717, 4, struct.pack("<I", 1)), (50721, 10, rational(1, 0, 0, 0, 1, 0, 0, 0, 1)),
            (50728, 5, rational(1, 1, 1)), (50778, 3, struct.pack("<H", 21)),
        ]

    sizes = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 10: 8}

    def directory(place):
        table, values = b"", b""
        listed = tags(place)
        start = 8 + 2 + 12 * len(listed) + 4
        for tag, kind, value in listed:
            head = struct.pack("<HHI", tag, kind, len(value) // sizes[kind])
            if len(value) > 4:
                table += head + struct.pack("<I", start + len(values))
                values += value + bytes(len(value) % 2)
            else:
                table += head + value.ljust(4, b"\0")
        return struct.pack("<H", len(listed)) + table + bytes(4) + values

    place = 8 + len(directory(0))
    with open(path, "wb") as file:
        file.write(b"II*\0" + struct.pack("<I", 8) + directory(place) + content)


def predictor_3():
    """Bytes of each row by their places, the highest first, as differences (Photoshop TIFF technical note 3)."""
    rows = floats.astype(">f4").view(np.uint8).reshape(SIDE, SIDE, 4).transpose(0, 2, 1).reshape(SIDE, -1)
    differences = rows.copy()
    differences[:, 1:] -= rows[:, :-1]
    return differences.tobytes()


plain, found = floats.tobytes(), {}
for name, content, compression, predictor in (
    ("uncompressed", plain, 1, 1),
    ("deflate, predictor 3", zlib.compress(predictor_3()), 8, 3),
    ("deflate, predictor 1", zlib.compress(plain), 8, 1),
):
    write("a.dng", content, compression, predictor)
    with rawpy.imread("a.dng") as raw:
        read = raw.raw_image / raw.white_level
    found[name] = float((np.abs(read - floats) < 1e-3).mean())
    print(f"{name:20}: {found[name]:.3f}")
right = found["uncompressed"] == found["deflate, predictor 3"] == 1 and found["deflate, predictor 1"] < 0.05
raise SystemExit(0 if right else "the behaviour has changed")
PY
