#!/usr/bin/env bash
# AVIF of 8 bits written by OpenCV 5.0.0 or Pillow 13.0.0 (both libavif) shifts every colour: chroma is rounded down, not to the
# nearest, half a code on the average. Red and blue come out 0.5 to 0.9 codes too low, green 0.4 too high; in the shadows
# (sRGB code 40 of 255) that is 2 to 3 % of light, of one sign in all pixels, so that no averaging takes it away, and a gray
# sample looks green. At 10 bits, and in JPEG by the same libraries, there is no such shift.
#
# The decoder is innocent: what it returns agrees with exact BT.601 from whole luminance and chroma codes (the residuals are
# rounding, mean below 0.05), and those codes lie 0.3 to 0.5 below the exact chroma of what was written.
#
# Output seen (mean of read minus written over 400 random colours, in codes of 8 bits; chroma: code found minus exact):
#   AVIF 8 bit, OpenCV : R -0.54 G +0.39 B -0.86   chroma Cb -0.47 Cr -0.35
#   AVIF 8 bit, Pillow : R -0.68 G +0.49 B -0.91   chroma Cb -0.51 Cr -0.46
#   AVIF 10 bit, OpenCV: R +0.04 G -0.02 B -0.04   chroma Cb -0.05 Cr +0.06
#   JPEG, OpenCV       : R +0.00 G +0.01 B -0.00   chroma Cb -0.01 Cr -0.01
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pillow==13.0.0 opencv-python-headless==5.0.0.93 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
from io import BytesIO

import cv2
import numpy as np
from PIL import Image

SIDE, COUNT = 16, 20
colours = np.random.default_rng(1).integers(20, 236, (COUNT * COUNT, 3))
picture = np.kron(colours.reshape(COUNT, COUNT, 3), np.ones((SIDE, SIDE, 1), int)).astype(np.uint8)


def by_opencv(suffix, *settings, scale=1):
    pixels = picture if scale == 1 else picture.astype(np.uint16) * 4
    data = cv2.imencode(suffix, np.ascontiguousarray(pixels[..., ::-1]), list(settings))[1]
    return cv2.imdecode(data, cv2.IMREAD_UNCHANGED)[..., ::-1] / scale


def by_pillow():
    data = BytesIO()
    Image.fromarray(picture).save(data, "AVIF", quality=99)
    return np.asarray(Image.open(data)).astype(float)


def middles(pixels):
    """The median of the middle of each square."""
    parts = pixels.reshape(COUNT, SIDE, COUNT, SIDE, 3)[:, 4:12, :, 4:12]
    return np.median(parts.transpose(0, 2, 1, 3, 4).reshape(COUNT * COUNT, -1, 3), axis=1)


def chroma(rgb):
    luminance = rgb @ [0.299, 0.587, 0.114]
    return np.stack([(rgb[:, 2] - luminance) / 1.772, (rgb[:, 0] - luminance) / 1.402], axis=1)


found = {}
for name, pixels in (
    ("AVIF 8 bit, OpenCV", by_opencv(".avif", cv2.IMWRITE_AVIF_DEPTH, 8, cv2.IMWRITE_AVIF_QUALITY, 99)),
    ("AVIF 8 bit, Pillow", by_pillow()),
    ("AVIF 10 bit, OpenCV", by_opencv(".avif", cv2.IMWRITE_AVIF_DEPTH, 10, cv2.IMWRITE_AVIF_QUALITY, 99, scale=4)),
    ("JPEG, OpenCV", by_opencv(".jpg", cv2.IMWRITE_JPEG_QUALITY, 99)),
):
    read = middles(pixels)
    off = (read - colours).mean(axis=0)
    codes = (np.round(chroma(read)) - chroma(colours.astype(float))).mean(axis=0)
    print(f"{name:19}: R {off[0]:+.2f} G {off[1]:+.2f} B {off[2]:+.2f}   chroma Cb {codes[0]:+.2f} Cr {codes[1]:+.2f}")
    found[name] = off
shifted = all(o[0] < -0.35 and o[1] > 0.25 and o[2] < -0.35 for o in (found["AVIF 8 bit, OpenCV"], found["AVIF 8 bit, Pillow"]))
others = max(np.abs(found["AVIF 10 bit, OpenCV"]).max(), np.abs(found["JPEG, OpenCV"]).max())
raise SystemExit(0 if shifted and others < 0.25 else "the behaviour has changed")
PY
