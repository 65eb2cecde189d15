#!/usr/bin/env bash
# OpenCV 5.0.0: warpAffine, warpPerspective and remap (INTER_LINEAR) sample floats of 32 bits where they are asked to, and doubles
# only at places of 1/32 pixel. Whoever turns to float64 for more precision gets a hundred times less.
#
# That OpenCV 4 sampled so was known. The bilinear paths written anew do not, but are for one, three and four channels of uint16
# and float32; the old tables of 32 x 32 weights are still taken, without a word, for float64, int16 and any picture of two
# channels (a field of displacements, a complex picture, slopes of a normal map). Such a picture moved by 0.01 pixels does not
# change at all; the derivative of a registration by finite differences is zero, or three times too large, and a fit stops
# where it began. Two channels split from a picture and warped one by one differ from the two warped together. INTER_CUBIC is
# no way out: it does not step, but its kernel (a = -0.75) gives no straight line back, and moves small shifts half too far.
#
# Output seen (a band-limited picture moved by parts of a pixel in steps of 1/128; what it was moved by, in parts of 1/128, by
# least squares on its slope; the three functions agree but for ties):
#   asked for              : 0.0 1.0 2.0 3.0 4.0 5.0 6.0 7.0 8.0
#   float32, 1 channel     : 0.0 1.0 2.0 3.0 4.0 5.0 6.0 7.0 8.0
#   float32, 3 channels    : 0.0 1.0 2.0 3.0 4.0 5.0 6.0 7.0 8.0
#   uint16,  1 channel     : 0.0 1.0 2.0 3.0 4.0 5.0 6.0 7.0 8.0
#   float32, 2 channels    : 0.0 0.0 4.0 4.0 4.0 4.0 8.0 8.0 8.0
#   float64, 1 channel     : 0.0 0.0 4.0 4.0 4.0 4.0 8.0 8.0 8.0
#   float32, INTER_CUBIC   : 0.0 1.5 2.9 4.4 5.8 7.2 8.6 9.9 11.2
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check opencv-contrib-python-headless==5.0.0.93 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import cv2
import numpy as np

WIDTH, HEIGHT, PARTS = 400, 64, 128
level = np.tile(10_000 * (1 + 0.5 * np.sin(np.arange(WIDTH) / 9)), (HEIGHT, 1))
rows, columns = np.indices((HEIGHT, WIDTH), np.float32)


def affine(picture, shift, kind=cv2.INTER_LINEAR):
    return cv2.warpAffine(picture, np.array([[1, 0, shift], [0, 1, 0.0]]), (WIDTH, HEIGHT), flags=kind | cv2.WARP_INVERSE_MAP)


def cubic(picture, shift):
    return affine(picture, shift, cv2.INTER_CUBIC)


def perspective(picture, shift):
    matrix = np.array([[1, 0, shift], [0, 1, 0], [0, 0, 1.0]])
    return cv2.warpPerspective(picture, matrix, (WIDTH, HEIGHT), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)


def remap(picture, shift):
    return cv2.remap(picture, columns + np.float32(shift), rows, cv2.INTER_LINEAR)


def moved(function, kind, channels):
    """By how many parts the first channel was moved, for each number of parts asked for."""
    picture = np.ascontiguousarray(np.repeat(level[..., None], channels, 2).astype(kind).squeeze())

    def first(pixels):
        return (pixels if pixels.ndim == 2 else pixels[..., 0]).astype(float)

    own = first(picture)
    slope = np.diff(own, axis=1)[:, 8:-8]
    change = [(first(function(picture, n / PARTS)) - own)[:, 8:-9] for n in range(9)]
    return np.array([(one * slope).sum() / (slope * slope).sum() * PARTS for one in change])


asked, exact, steps = np.arange(9.0), [], []
print("asked for              :", *asked)
for kind, channels, fine in (
    ("float32", 1, True), ("float32", 3, True), ("uint16", 1, True), ("float32", 2, False), ("float64", 1, False),
):
    for function in (affine, perspective, remap):
        found = moved(function, kind, channels)
        (exact if fine else steps).append(found)
        if function is affine:
            words = " ".join(f"{one:.1f}" for one in found)
            print(f"{kind + ',':8} {channels} channel{'s' if channels > 1 else ' '}    : {words}")
smooth = moved(cubic, "float32", 1)
print("float32, INTER_CUBIC   :", " ".join(f"{one:.1f}" for one in smooth))
right = np.abs(np.array(exact) - asked).max() < 0.1 and np.abs(np.array(steps) / 4 - np.round(np.array(steps) / 4)).max() < 0.02
right = right and all(abs(one[1]) < 0.1 and abs(one[3] - 4) < 0.1 for one in steps) and abs(smooth[1] - 1.5) < 0.1
raise SystemExit(0 if right else "the behaviour has changed")
PY
