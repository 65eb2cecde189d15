"""Rendered sets that several files of the closed loop share."""

from pathlib import Path

import pytest

from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import synthesize


@pytest.fixture(scope="session")
def on_white(shared_by_workers) -> Path:
    """A plastic ball whose board is nearly as white as the table: 8 lamps in given places."""
    scene = changed(
        load_scene("example"),
        brdf={"model": "plastic", "albedo": [0.55, 0.3, 0.12], "roughness": 0.25},
        camera={"size": (420, 280), "focal": 945.0, "calibration": 0, "given": True},
        board={"table": 0.8, "ink": 0.5},
        lamp={"count": 8, "given": True},
        render={"near": 2, "edge": 4},
    )
    return shared_by_workers.once("on-white", lambda folder: synthesize(scene, folder / "white", 2))
