"""Lamps as far away as the sun, and their light as even: what no falloff tells, nothing may be made of."""

from pathlib import Path

import pytest

from photogonio.evaluate.scenes import evaluate_scene
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.scene import load_scene
from photogonio.system.progress import Reporter

pytestmark = pytest.mark.slow

SUN = {"kind": "directional", "radius": 0.27, "given": True}
KNOWN = {"calibration": 0, "given": True}  # of the size in which black print is read at all
MOST, STRENGTH = 0.012, 0.002  # of f below 70 degrees, which six photos tell; and of the lamps


def test_ink_is_no_veil_under_suns(tmp_path: Path):
    """Its own share of white, 5 %, was taken off as one: 6 to 22 % of the sample's light."""
    scene = changed(
        load_scene("example"),
        camera=KNOWN,
        lamp=SUN | {"count": 6},
        render={"near": 2, "edge": 4},
        mirror_ball=(),
    )
    found = evaluate_scene(scene, tmp_path, workers=2, reporter=Reporter(quiet=True))
    assert "veiling-glare" not in [one.code for one in found.result.setup.diagnoses]
    assert found.calibration.strength < STRENGTH
    assert found.error <= MOST
