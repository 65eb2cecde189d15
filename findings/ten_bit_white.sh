#!/usr/bin/env bash
# Ten-bit photos: three ways to ask for 16-bit numbers, three codes for white, and none of them is 65535.
#
# pillow-heif 1.8.1 (convert_hdr_to_8bit=False) shifts 10-bit codes up: white, 1023, becomes 65472.
# opencv-python-headless 5.0.0 gives a 10-bit AVIF as uint16 with the codes as they are: white is 1023.
# pillow-heif with hdr_to_16bit=False gives the codes as they are as well ("RGB;10").
#
# In both libraries uint16 means full scale 65535 for every other format (PNG, TIFF). Taken so, a HEIC is 0.1 % too dark and is
# never saturated (nothing reaches the white level, so clipped highlights are believed), and an AVIF is 64 times too dark; after
# the sRGB curve, which is straight for such small codes, gray 0.5 comes out at 0.0006 instead of 0.21.
#
# Output seen:
#   HEIC, pillow-heif, 16 bit : RGB;16    uint16 black 0 gray 32832 white 65472
#   HEIC, pillow-heif, as is  : RGB;10    uint16 black 0 gray 513 white 1023
#   AVIF, OpenCV              : (no mode) uint16 black 0 gray 513 white 1023
#   PNG, OpenCV               : (no mode) uint16 black 0 gray 32864 white 65535
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pillow-heif==1.8.1 pillow==13.0.0 \
    opencv-python-headless==5.0.0.93 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import cv2
import numpy as np
import pillow_heif

codes = np.repeat(np.array([0, 513, 1023], np.uint16), 64)  # black, gray, white; 64 columns each
picture = np.ascontiguousarray(np.broadcast_to(codes[None, :, None], (64, 192, 3)))
file = pillow_heif.from_bytes("RGB;16", (192, 64), (picture << 6).tobytes())
file.save("a.heic", quality=-1, chroma=444)
cv2.imwrite("a.avif", picture, [cv2.IMWRITE_AVIF_DEPTH, 10, cv2.IMWRITE_AVIF_QUALITY, 100])
cv2.imwrite("a.png", (picture.astype(np.float64) / 1023 * 65535).round().astype(np.uint16))

found = []


def show(name, mode, pixels):
    values = [int(pixels[32, x, 1]) for x in (32, 96, 160)]
    print(f"{name:26}: {mode:9} {pixels.dtype} black {values[0]} gray {values[1]} white {values[2]}")
    found.append((str(pixels.dtype), values[2]))


shifted = pillow_heif.open_heif("a.heic", convert_hdr_to_8bit=False)
show("HEIC, pillow-heif, 16 bit", shifted.mode, np.asarray(shifted))
plain = pillow_heif.open_heif("a.heic", convert_hdr_to_8bit=False, hdr_to_16bit=False)
show("HEIC, pillow-heif, as is", plain.mode, np.asarray(plain))
show("AVIF, OpenCV", "(no mode)", cv2.imread("a.avif", cv2.IMREAD_UNCHANGED))
show("PNG, OpenCV", "(no mode)", cv2.imread("a.png", cv2.IMREAD_UNCHANGED))
expected = [("uint16", 65472), ("uint16", 1023), ("uint16", 1023), ("uint16", 65535)]
raise SystemExit(0 if found == expected else "the behaviour has changed")
PY
