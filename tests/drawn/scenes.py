"""Built-in scenes in small: shared by tests and benchmarks of whole runs."""

from __future__ import annotations

from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene


def before_given_camera(scene: Scene, width: int) -> Scene:
    """The scene before a camera of ``width`` pixels that is given; edges are sampled coarsely."""
    ratio = width / scene.camera.size[0]
    camera = {
        "size": tuple(round(ratio * side) for side in scene.camera.size),
        "focal": ratio * scene.camera.focal,
        "center": tuple(ratio * place for place in scene.camera.center),
        "calibration": 0,
        "given": True,
    }
    return changed(scene, camera=camera, render={"near": 2, "edge": 4})
