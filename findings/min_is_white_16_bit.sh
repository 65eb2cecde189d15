#!/usr/bin/env bash
# OpenImageIO 3.2.2.0: a gray TIFF whose PhotometricInterpretation is 0 (min is white) is turned to light if it has 8 bits,
# and handed over as its negative, without a word, if it has 16 bits or floats.
#
# TIFF 6.0, page 37: "WhiteIsZero. For bilevel and grayscale images: 0 is imaged as white." It says nothing of bit depth.
# Scanners and old microscope cameras write such files. A reader that has looked at an 8-bit one trusts the library, and takes
# the negative of a 16-bit one for radiance: bright is dark, a BRDF comes out as its complement. The attribute
# tiff:PhotometricInterpretation is 0 in all three cases, so it does not tell whether the work has been done.
#
# Output seen:
#   8 bit : stored [0, 100, 255]      read [255, 155, 0]       attribute 0
#   16 bit: stored [0, 1000, 65535]   read [0, 1000, 65535]    attribute 0
#   float : stored [0.0, 0.25, 1.0]   read [0.0, 0.25, 1.0]    attribute 0
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check OpenImageIO==3.2.2.0 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import struct

import numpy as np
import OpenImageIO as oiio


def write(path, pixels):
    """A baseline TIFF, one strip, min is white."""
    bits, floats = 8 * pixels.dtype.itemsize, pixels.dtype.kind == "f"
    tags = [(256, 3, pixels.size), (257, 3, 1), (258, 3, bits), (259, 3, 1), (262, 3, 0), (273, 4, 134), (277, 3, 1),
            (278, 3, 1), (279, 4, pixels.nbytes), (339, 3, 3 if floats else 1)]
    entries = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
    data = b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + bytes(4)
    with open(path, "wb") as file:
        file.write(data.ljust(134, b"\0") + pixels.tobytes())


found = {}
for name, kind, values in (("8 bit ", "u1", [0, 100, 255]), ("16 bit", "<u2", [0, 1000, 65535]), ("float ", "<f4", [0, 0.25, 1])):
    pixels = np.array(values, kind)
    write("a.tif", pixels)
    file = oiio.ImageInput.open("a.tif")
    spec = file.spec()
    read = file.read_image(str(spec.format)).ravel()
    attribute = spec.get_int_attribute("tiff:PhotometricInterpretation", -1)
    print(f"{name}: stored {str(pixels.tolist()):18} read {str(read.tolist()):18} attribute {attribute}")
    found[name.strip()] = (read.tolist() == pixels.tolist(), attribute)
expected = {"8 bit": (False, 0), "16 bit": (True, 0), "float": (True, 0)}
raise SystemExit(0 if found == expected else "the behaviour has changed")
PY
