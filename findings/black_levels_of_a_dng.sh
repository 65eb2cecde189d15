#!/usr/bin/env bash
# rawpy 0.28.0 (LibRaw 0.22.2): of the ways in which a DNG states its black level, only one arrives whole: integers that repeat
# by 2 x 2.
#
# DNG 1.7.1: BlackLevel is rational and repeats by BlackLevelRepeatDim; BlackLevelDeltaH and BlackLevelDeltaV are added to it,
# a number a column and a number a row. Phones measure black anew for each frame, and Android's DngCreator writes it in hundredths
# of a code; DNGs of a Canon EOS 400D have BlackLevel 0 and all of their black in 2602 numbers of DeltaV (dnglab issue 820).
#   - A fraction is cut off, not rounded: always too low a black, by up to a code.
#   - DeltaH and DeltaV become their mean: stripes stay.
#   - A larger repeat is neither in black_level_per_channel, which has its least number for all channels, nor taken out by
#     postprocess with no_auto_scale=True, the way to ask for camera codes; with scaling it is taken out.
# At 10 bits a sample that reflects 2 % lies 19 codes above black: 0.9 of a code is 5 % of its light, of one sign in all photos,
# so that no averaging takes it away, and dark samples are where a BRDF is looked at in ratios.
#
# Output seen (a mosaic of 19 codes of light above the black that its DNG states, dithered; codes that are left, least and
# greatest over the places of 4 x 4; columns: raw_image - black_level_per_channel, postprocess without scaling, with scaling):
#   whole, 2 x 2       : 19.00 (19.00 to 19.00)   19.00 (19.00 to 19.00)   18.93 (18.93 to 18.93)
#   fraction 0.9, 2 x 2: 19.90 (19.88 to 19.91)   19.78 (19.63 to 19.91)   19.83 (19.81 to 19.84)
#   repeat of 4 x 4    : 26.50 (19.00 to 34.00)   26.50 (20.00 to 33.00)   18.99 (18.99 to 18.99)
#   columns, DeltaH    : 19.00 (17.00 to 25.00)   19.00 (17.00 to 25.00)   18.99 (17.00 to 24.99)
#   rows, DeltaV       : 19.00 (17.00 to 25.00)   19.00 (17.00 to 25.00)   18.99 (17.00 to 24.99)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check rawpy==0.28.0 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import struct

import numpy as np
import rawpy

SIDE, LIGHT, WHITE = 192, 19, 1023  # codes of 10 bits
rng = np.random.default_rng(0)


def rational(*values):
    return b"".join(struct.pack("<ii", round(value * 100), 100) for value in values)


def write(path, mosaic, levels):
    """A baseline DNG 1.4: one strip of 16 bits, a mosaic of red, green, green, blue."""
    content = mosaic.astype("<u2").tobytes()
    fixed = [
        (254, 4, struct.pack("<I", 0)), (256, 4, struct.pack("<I", SIDE)), (257, 4, struct.pack("<I", SIDE)),
        (258, 3, struct.pack("<H", 16)), (259, 3, struct.pack("<H", 1)), (262, 3, struct.pack("<H", 32803)),
        (271, 2, b"Maker\0"), (272, 2, b"Model\0"), (277, 3, struct.pack("<H", 1)), (278, 4, struct.pack("<I", SIDE)),
        (279, 4, struct.pack("<I", len(content))), (284, 3, struct.pack("<H", 1)), (33421, 3, struct.pack("<HH", 2, 2)),
        (33422, 1, bytes([0, 1, 1, 2])), (50706, 1, bytes([1, 4, 0, 0])), (50708, 2, b"Maker Model\0"),
        (50717, 4, struct.pack("<I", WHITE)), (50721, 10, rational(1, 0, 0, 0, 1, 0, 0, 0, 1)),
        (50728, 5, rational(1, 1, 1)), (50778, 3, struct.pack("<H", 21)),
    ]
    sizes = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 10: 8}

    def directory(place):
        table, values = b"", b""
        listed = sorted([*fixed, *levels, (273, 4, struct.pack("<I", place))])
        start = 8 + 2 + 12 * len(listed) + 4
        for tag, kind, value in listed:
            head = struct.pack("<HHI", tag, kind, len(value) // sizes[kind])
            if len(value) > 4:
                table += head + struct.pack("<I", start + len(values))
                values += value + bytes(len(value) % 2)
            else:
                table += head + value.ljust(4, b"\0")
        return struct.pack("<H", len(listed)) + table + bytes(4) + values

    with open(path, "wb") as file:
        file.write(b"II*\0" + struct.pack("<I", 8) + directory(8 + len(directory(0))) + content)


def cells(pixels):
    """The mean of each place of 4 x 4, over all repeats but those of the border."""
    inner = pixels[8:-8, 8:-8]
    return inner.reshape(inner.shape[0] // 4, 4, inner.shape[1] // 4, 4).mean(axis=(0, 2))


def left(name, black, levels):
    """What is left of LIGHT by each of the three ways: (mean, span over the places of 4 x 4)."""
    mosaic = np.floor(np.broadcast_to(black, (SIDE, SIDE)) + LIGHT + rng.random((SIDE, SIDE)))  # means keep fractions
    write("a.dng", mosaic, levels)
    found = []
    for scaled in (None, False, True):
        with rawpy.imread("a.dng") as raw:
            told = np.array(raw.black_level_per_channel, float)
            if scaled is None:
                codes = raw.raw_image_visible - told[raw.raw_colors_visible]
            else:
                codes = raw.postprocess(
                    output_bps=16, gamma=(1, 1), no_auto_bright=True, adjust_maximum_thr=0.0, no_auto_scale=not scaled,
                    user_wb=[1.0, 1.0, 1.0, 1.0], output_color=rawpy.ColorSpace.raw,
                    demosaic_algorithm=rawpy.DemosaicAlgorithm.LINEAR,
                )[..., 1].astype(float)
            codes = cells(codes * ((WHITE - told.mean()) / 65535 if scaled else 1.0))
        found.append((codes.mean(), codes.min(), codes.max()))
    print(f"{name:19}: " + "   ".join("{:5.2f} ({:5.2f} to {:5.2f})".format(*one) for one in found))
    return found


def repeat(table):
    return np.tile(table, (SIDE // len(table), SIDE // len(table)))


def pattern(table):
    return [(50713, 3, struct.pack("<HH", *table.shape)), (50714, 5, rational(*table.ravel()))]


whole = np.array([[64.0, 66.0], [68.0, 70.0]])
four = 64.0 + np.arange(16.0).reshape(4, 4)
lines = np.tile([0.0, 0.0, 0.0, 8.0], SIDE // 4)
even = [(50714, 5, rational(64.0))]
found = [
    left("whole, 2 x 2", repeat(whole), pattern(whole)),
    left("fraction 0.9, 2 x 2", repeat(whole) + 0.9, pattern(whole + 0.9)),
    left("repeat of 4 x 4", repeat(four), pattern(four)),
    left("columns, DeltaH", 64.0 + lines, [*even, (50715, 10, rational(*lines))]),
    left("rows, DeltaV", 64.0 + lines[:, None], [*even, (50716, 10, rational(*lines))]),
]
means = np.array([[way[0] for way in one] for one in found]) - LIGHT
spans = np.array([[way[2] - way[1] for way in one] for one in found])
right = (
    np.abs(means[0]).max() < 0.1  # whole numbers in 2 x 2
    and (np.abs(means[1] - 0.9) < 0.2).all()
    and (np.abs(means[2, :2] - 7.5) < 0.1).all() and abs(means[2, 2]) < 0.1 and (spans[2, :2] > 12).all()
    and (spans[3:] > 7.9).all()
)
raise SystemExit(0 if right else "the behaviour has changed")
PY
