"""Printed greys: drawn as dark as they are, and not told."""

import numpy as np

from photogonio.synthetic.render.world import sheets
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.parts import PatchScene
from photogonio.synthetic.scene.plan import camera_of, plan
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.manifest import manifest_of

OUTLINE = ((0.0, -12.0), (30.0, -12.0), (30.0, -4.0), (0.0, -4.0))


def test_greys_are_drawn_and_their_reflectance_is_not_told():
    grey = PatchScene(OUTLINE, height=0.0, reflectance=(0.3,))
    scene = changed(load_scene("phone-plane"), grey_patch=(grey,))
    shots = plan(scene)
    outlines, _, sample, reflectance = sheets(scene, next(shot for shot in shots if shot.role == "sample"))
    white = len(scene.white_patch)
    assert sample == len(outlines) - 1 and len(outlines) == white + 2
    np.testing.assert_array_equal(outlines[white], OUTLINE)
    np.testing.assert_array_equal(reflectance[white], [0.3, 0.3, 0.3])
    told = manifest_of(scene, camera_of(scene), shots)["grey_patch"]
    assert told == [{"outline": [list(point) for point in OUTLINE], "height": 0.0}]
