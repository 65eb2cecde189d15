"""The truth beside a rendered set, as plain JSON values (docs/scenes.md)."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.synthetic.brdf.library import angle_grid, on_grid
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.render.world import ambient
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.plan import Shot, exposure_factor

FORMAT = "photogonio-truth"
COPY = "truth-brdf"  # name, before its own ending, of the copy of a BRDF's file that stands beside the truth


def truth_of(scene: Scene, camera: Camera, brdf: Reflectance, shots: tuple[Shot, ...]) -> dict[str, object]:
    """Camera, poses, lamps, sample, radiance scale and BRDF; lengths in the set's unit, angles in degrees."""
    described = asdict(scene)
    described.pop("folder")
    return {
        "format": FORMAT,
        "version": 1,
        "scene": described,
        "camera": {
            "matrix": camera.matrix.tolist(),
            "distortion": camera.distortion.tolist(),
            "size": list(camera.size),
        },
        "radiance_scale": exposure_factor(scene),  # full scale is radiance x seconds x this = 1
        "ambient": ambient(scene),
        "photos": [photo_truth(scene, shot) for shot in shots],
        "brdf": brdf_truth(scene, brdf),
    }


def photo_truth(scene: Scene, shot: Shot) -> dict[str, object]:
    found: dict[str, object] = {
        "file": shot.file,
        "role": shot.role,
        "rotation": shot.pose.rotation.tolist(),
        "translation": shot.pose.translation.tolist(),
        "exposure_time": shot.exposure_time,
        "lights": [
            {
                "id": lamp.id,
                "kind": lamp.kind,
                "direction" if lamp.kind == "directional" else "position": np.asarray(lamp.place).tolist(),
                "radius": lamp.radius,
                "strength": lamp.intensity.tolist(),
                "shaded": lamp.shaded,
            }
            for lamp in shot.lamps
        ],
    }
    if shot.offset is not None:
        found["sample_offset"] = shot.offset.tolist()
        if scene.sample.shape == "sphere":
            found["sample_center"] = (np.array(scene.sample.center) + shot.offset).tolist()
    return found


def brdf_truth(scene: Scene, brdf: Reflectance) -> dict[str, object]:
    """The BRDF as a model and on the grid of middles of five-degree cells, the light in the plane of x."""
    grid = angle_grid()
    return {
        "model": scene.brdf if "file" not in scene.brdf else scene.brdf | {"file": copy_name(scene)},
        "isotropic": brdf.isotropic,
        "reciprocal": brdf.reciprocal,
        "grid": {
            "theta_i": np.round(np.degrees(np.unique(grid[:, 0])), 9).tolist(),
            "theta_r": np.round(np.degrees(np.unique(grid[:, 1])), 9).tolist(),
            "dphi": np.round(np.degrees(np.unique(grid[:, 2])), 9).tolist(),
            "values": on_grid(brdf, grid).tolist(),  # (theta_i theta_r dphi, channels), dphi fastest
        },
    }


def copy_name(scene: Scene) -> str:
    """What the file of the scene's BRDF is called in the set."""
    return COPY + Path(str(scene.brdf["file"])).suffix
