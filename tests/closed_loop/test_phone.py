"""A telephone's photos, small and few, as its files have them: hand-held JPEG, times by their names, its own flash at a
place that is not told, no balls. The tone curve is sRGB's; one that nobody tells is for tests/calib/response."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.compare.reflectances import load_known
from photogonio.evaluate.hard_cases import cells_at
from photogonio.evaluate.truth import TRUTH
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import synthesize
from tests.closed_loop.test_scenes import STATED, directions
from tests.drawn.scenes import before_given_camera

pytestmark = pytest.mark.slow


def test_photos_of_a_telephone_are_measured_as_well_as_is_said(tmp_path):
    scene = before_given_camera(load_scene("phone-plane"), 450)
    scene = changed(scene, lamp={"count": 6}, sensor={"encoding": "srgb"})
    folder = synthesize(scene, tmp_path / "set")
    found = process(folder, None, Options(workers=1))
    incident, exit = directions(1), directions(2)
    truth = load_known(folder / TRUTH).evaluate(incident, exit)
    off = found.brdf(incident, exit) - truth
    half = found.fit.uncertainty.half_width(found.fit.standard_error(cells_at(incident, exit)))
    assert found.brdf.scale == "absolute" and len(found.setup.views) == 6
    # it was 3.0 %, in the darkest channel; 1.5 times as much is still the same
    assert np.median(np.abs(off) / truth, axis=0).max() <= 0.045
    assert np.sqrt((off**2).mean(0) / (half**2).mean(0)).max() <= STATED
