#!/usr/bin/env bash
# Mitsuba 3.9.1: an environment map's columns are pixels, its rows are not. Columns stand for the middles of W equal sectors, as
# in any picture; the first and last row for the poles themselves, the others for H - 1 equal steps between.
#
# A map that was measured or computed by the middles of its pixels, as panoramas and lamp maps are, is stretched in elevation and
# not in azimuth: every light moves away from the equator, by half a row near the poles, and the light of a row is not what its
# solid angle says: in the top row 44 % of it for 8 rows, 38 % for 16, and a third however fine the map is; 6 % (16 rows) to
# 12 % (8 rows) too much at the equator. An even sky shows nothing of it, so a white furnace passes. A light overhead is two
# thirds too dark, and BRDFs fitted to such renders take that over as a fall of reflectance near the normal.
#
# Output seen (one row, or one column, of ones in a map of zeros, H rows by 2 H columns; angles in degrees; light over what it
# would be from the pixels' own solid angles):
#   H  8, row  0: middle  11.25, seen at   8.57, light 0.437
#   H  8, row  1: middle  33.75, seen at  25.71, light 0.883
#   H  8, row  4: middle 101.25, seen at 102.86, light 1.124
#   H  8, column 3: middle  78.75, seen at  78.75
#   H 64, row  0: middle   1.41, seen at   0.95, light 0.344
#   H 64, row  1: middle   4.22, seen at   2.86, light 0.688
#   H 64, row 32: middle  91.41, seen at  91.43, light 1.016
#   H 64, column 3: middle   9.84, seen at   9.84
#   even sky: light 1.000
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check mitsuba==3.9.1 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")


def emitter(pixels):
    return mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(np.repeat(pixels[..., None], 3, 2).astype(np.float32))})


def radiance(light, elevation, azimuth):
    """From where the polar angle from the map's top edge and the azimuth along its columns are as given, in radians."""
    toward = np.sin(elevation) * np.sin(azimuth), np.cos(elevation), -np.sin(elevation) * np.cos(azimuth)
    seen = dr.zeros(mi.SurfaceInteraction3f)
    seen.wi = mi.Vector3f(*(-float(one) for one in toward))
    return light.eval(seen)[0]


STEPS = 4000
polar = (np.arange(STEPS) + 0.5) / STEPS * np.pi
found = {}
for height in (8, 64):
    for row in (0, 1, height // 2):
        pixels = np.zeros((height, 2 * height))
        pixels[row] = 1
        light = emitter(pixels)
        seen = np.array([radiance(light, angle, 0.3) for angle in polar])
        own = np.cos(row * np.pi / height) - np.cos((row + 1) * np.pi / height)
        ratio = float((seen * np.sin(polar)).mean() * np.pi / own)
        where, middle = np.degrees((seen * polar).sum() / seen.sum()), (row + 0.5) * 180 / height
        print(f"H {height:2}, row {row:2}: middle {middle:6.2f}, seen at {where:6.2f}, light {ratio:.3f}")
        found[height, row] = ratio
    pixels = np.zeros((height, 2 * height))
    pixels[:, 3] = 1
    light, around = emitter(pixels), np.radians(np.arange(0, 180, 0.05))
    seen = np.array([radiance(light, 1.3, angle) for angle in around])
    where, middle = np.degrees((seen * around).sum() / seen.sum()), 3.5 * 180 / height
    print(f"H {height:2}, column 3: middle {middle:6.2f}, seen at {where:6.2f}")
    found[height, "column"] = abs(where - middle)
even = np.mean([radiance(emitter(np.ones((8, 16))), angle, 0.3) for angle in polar[::100]])
print(f"even sky: light {even:.3f}")
right = (
    found[8, 0] < 0.5 and found[64, 0] < 0.4 and found[8, 4] > 1.08 and abs(even - 1) < 1e-3
    and max(found[8, "column"], found[64, "column"]) < 0.05
)
raise SystemExit(0 if right else "the behaviour has changed")
PY
