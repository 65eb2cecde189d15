"""
Photo set to Mitsuba render
===========================

Photos of a ball on a printed board go in, and a ball that Mitsuba renders with the measured BRDF comes out. The photos
are rendered here, small and few, so that this takes seconds; yours take their place in the second step.

Run it in an empty folder, or give it one: ``python photoset_to_mitsuba.py FOLDER``. Mitsuba is an extra
(``pip install 'photogonio[consumers]'``); without it the export is written and its loss told all the same.
"""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import photogonio as pg
from photogonio.synthetic.scene.scene import load_scene

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# %%
# Photos
# ------
# Red plastic, a rough coat over a coloured ground: eight photos of 300 x 200 pixels, the lamp elsewhere in each, and
# four of the board alone. Two mirror balls and a white patch of known reflectance lie beside the sample.

scene = load_scene("plastic-ball")
scene = replace(
    scene,
    camera=replace(scene.camera, size=(300, 200), focal=scene.camera.focal / 2, calibration=4),
    lamp=replace(scene.lamp, count=8),
)
photos = pg.synthesize(scene, folder / "red-plastic")

# %%
# Measurement
# -----------
# The same as ``photogonio process red-plastic -o red-plastic-brdf``: camera, lamps, directions of all pixels, and the
# fit. The folder holds the report too.

result = pg.process(photos, folder / "red-plastic-brdf", pg.Options(workers=1))
b = result.brdf
print(b)
for warning in result.warnings:
    print("warning:", warning)

# %%
# How bright it is straight on, of each channel: the share of light from the normal that is sent out again, and the
# same of the BRDF that the photos were rendered with.

found, true = b.directional_albedo(0.0), pg.load(photos).directional_albedo(0.0)
print("found", found.round(4), "true", true.round(4))

# %%
# Export
# ------
# Each export is read back as its consumer reads it, and says what it loses.

path = folder / "red-plastic.bsdf"
print(b.export("mitsuba", path))

# %%
# Mitsuba
# -------
# Under even light of radiance 1 the middle of a ball sends to the eye just that share, by reciprocity: a check of the
# whole chain in one number a channel. Then the same ball under a lamp.


def rendered(mi, lights, side, samples):
    """(side, side, 3) radiance of a ball of radius 1, seen from z by parallel rays."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": {
            "type": "orthographic",
            "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
            @ mi.ScalarTransform4f().scale([1.1, 1.1, 1]),
            "film": {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": samples},
        },
        "ball": {"type": "sphere", "material": {"type": "measured", "filename": str(path)}},
    }
    scene |= {f"light {k}": light for k, light in enumerate(lights)}
    return np.array(mi.render(mi.load_dict(scene)))[..., :3]


if importlib.util.find_spec("mitsuba"):
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    even = rendered(mi, [{"type": "constant", "radiance": 1.0}], side=32, samples=1024)
    print("Mitsuba sends", even[14:18, 14:18].mean(axis=(0, 1)).round(4))

    dim, lamp = {"type": "constant", "radiance": 0.1}, {"type": "directional", "direction": [-1, -1, -1.2]}
    picture = rendered(mi, [dim, lamp | {"irradiance": 3.0}], side=160, samples=32)
    plt.imsave(folder / "mitsuba.png", np.clip(picture, 0.0, 1.0) ** (1 / 2.2))
else:
    print("Mitsuba is not installed")

# %%
# The same BRDF as ``photogonio show`` draws it: lobes, cuts, and balls under three lights.

b.plot().savefig(folder / "red-plastic.png", dpi=80)
