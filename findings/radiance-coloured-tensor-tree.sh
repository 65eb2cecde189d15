#!/usr/bin/env bash
# Radiance's BSDF library, as pyradiance 1.3.1 ships it: a coloured tensor tree whose cells differ in colour comes back
# in other colours, as soon as it has a diffuse part.
#
# A tree may hold "Visible" (Y), "CIE-u" and "CIE-v" (u', v'), which is how coloured reflection is stored. On loading,
# the least value of the tree is taken out as the diffuse part, and u' and v' of what is left are made anew. Three trees
# of four cells, each asked for the tristimulus values of every cell:
#
#   1. one colour in all cells, with a diffuse part: right within 1e-3;
#   2. a white cell among black ones, no diffuse part: right within 1e-3;
#   3. the sum of both, a white gloss over a red ground: Y is right, X and Z of the glossy cell are not.
#
# Expected for the glossy cell of the third: X, Y, Z = 1.0205, 1.05, 1.105. Seen: 2.22, 1.05, -0.016: the blue is gone,
# and a negative number is left. So colours measured as gloss over a coloured ground cannot be handed over in one such
# file; a gray file a channel, or of Y alone, is read back as written.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check "pyradiance==1.3.1" "numpy==2.4.6"
cat > "$folder/ask.py" <<'PY'
import sys

import numpy as np
import pyradiance.bsdf as bsdf

BLOCK = """<WavelengthData><LayerNumber>System</LayerNumber><Wavelength unit="Integral">{}</Wavelength>
<WavelengthDataBlock><WavelengthDataDirection>Reflection Back</WavelengthDataDirection>
<AngleBasis>LBNL/Shirley-Chiu</AngleBasis><ScatteringDataType>BRDF</ScatteringDataType>
<ScatteringData>{}</ScatteringData></WavelengthDataBlock></WavelengthData>"""
FILE = """<?xml version="1.0"?><WindowElement xmlns="http://windows.lbl.gov">
<WindowElementType>System</WindowElementType><FileType>BSDF</FileType><Optical><Layer>
<Material><Name>a</Name><Manufacturer>b</Manufacturer></Material>
<DataDefinition><IncidentDataStructure>TensorTree3</IncidentDataStructure></DataDefinition>
{}</Layer></Optical></WindowElement>"""
RED, WHITE = np.array([0.07, 0.05, 0.016]), np.array([0.9505, 1.0, 1.089])


def tree(values):
    """Four cells of exit directions; the upper half of the first axis holds nothing in an isotropic tree."""
    return "{" + "".join("{ %.7g } { 0 }" % value for value in values) + "}"


def answer(cells):
    """Tristimulus values that the library gives for the four cells."""
    cells = np.array(cells)
    shown = np.where(cells[:, 1:2] > 0, cells, WHITE)
    total = shown @ [1.0, 15.0, 3.0]
    data = {"Visible": cells[:, 1], "CIE-u": 4 * shown[:, 0] / total, "CIE-v": 9 * shown[:, 1] / total}
    path = sys.argv[1]
    with open(path, "w") as file:
        file.write(FILE.format("".join(BLOCK.format(name, tree(values)) for name, values in data.items())))
    sd = bsdf.load_file(path)
    found = [np.array(bsdf.query(sd, 30.0, 0.0, 40.0, turn)) for turn in (45.0, 135.0, 225.0, 315.0)]
    return cells, sorted(found, key=lambda xyz: -xyz[1])


ok = True
for name, ground, gloss in (("one colour", RED, 0 * WHITE), ("white on black", 0 * RED, WHITE), ("white on red", RED, WHITE)):
    cells, found = answer([ground + gloss, ground, ground, ground])
    print(f"{name}: wrote {cells[0]}, read {np.round(found[0], 4)}")
    right = np.allclose(found[0], cells[0], rtol=1e-3, atol=1e-3)
    if name == "white on red":
        ok &= abs(found[0][1] / cells[0][1] - 1) < 1e-3 and found[0][0] > 2.0 and found[0][2] < 0.05
    else:
        ok &= bool(right)
sys.exit(0 if ok else 1)
PY
"$folder/venv/bin/python" "$folder/ask.py" "$folder/tree.xml"
echo "as described: a white gloss over a red ground is read back with X twice and Z none of what was written"
