"""The manifest of a rendered set: what somebody would have measured and written, right or wrong."""

from __future__ import annotations

import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.parts import BoardScene
from photogonio.synthetic.scene.plan import FLASH, Shot, lamp_intensity
from photogonio.synthetic.write.pictures import WITH_EXIF


def manifest_of(scene: Scene, camera: Camera, shots: tuple[Shot, ...]) -> dict[str, object]:
    """The table of ``photoset.toml`` (docs/photoset.md)."""
    found: dict[str, object] = {
        "format": 1,
        "name": scene.name,
        "length_unit": scene.length_unit,
        "sample": sample_table(scene),
        "radiometry": radiometry_table(scene),
        "camera": camera_table(scene, camera, shots),
        "photo": [photo_table(scene, shot) for shot in shots],
    }
    if scene.board is not None:
        found["board"] = board_table(scene.board)
    if scene.mirror_ball:
        found["mirror_ball"] = [{"center": list(b.center), "radius": b.radius} for b in scene.mirror_ball]
    if scene.white_patch:
        found["white_patch"] = [
            {"outline": [list(p) for p in w.outline], "height": w.height, "reflectance": list(w.reflectance)}
            for w in scene.white_patch
        ]
    if scene.grey_patch:
        found["grey_patch"] = [
            {"outline": [list(p) for p in g.outline], "height": g.height} for g in scene.grey_patch
        ]
    lights = light_tables(scene, shots)
    if lights:
        found["light"] = lights
    return found


def sample_table(scene: Scene) -> dict[str, object]:
    s = scene.sample
    if s.shape == "sphere":
        return {"shape": "sphere", "center": list(s.center), "radius": s.radius, "symmetry": s.symmetry}
    outline = [list(p) for p in s.outline]
    return {"shape": "plane", "outline": outline, "height": s.height, "symmetry": s.symmetry}


def board_table(b: BoardScene) -> dict[str, object]:
    found: dict[str, object] = {"kind": b.kind, "dictionary": b.dictionary}
    if b.kind == "markers":
        return found | {"marker": [{"id": m.id, "corners": [list(p) for p in m.corners]} for m in b.marker]}
    found["marker_length"] = b.marker_length
    if b.kind == "charuco" and b.squares is not None:
        found |= {"squares": list(b.squares), "square_length": b.square_length}
    elif b.markers is not None:
        found |= {"markers": list(b.markers), "marker_separation": b.marker_separation}
    optional = {"first_id": b.first_id, "legacy_pattern": b.legacy_pattern}
    return found | {k: v for k, v in optional.items() if v}


def radiometry_table(scene: Scene) -> dict[str, object]:
    sensor = scene.sensor
    encoding = "unknown" if sensor.encoding == "tone" else sensor.encoding
    found: dict[str, object] = {"encoding": encoding, "black_level": sensor.black_level}
    if sensor.encoding == "gamma":
        found["gamma"] = sensor.gamma
    if sensor.declare_noise and sensor.gain_electrons:
        found |= {
            "gain_electrons": sensor.gain_electrons,
            "read_noise_electrons": sensor.read_noise_electrons,
        }
    if scene.camera.vignetting != "none" or sensor.flat_photo:
        found["vignetting"] = "flat" if sensor.flat_photo else scene.camera.vignetting
    return found


def camera_table(scene: Scene, camera: Camera, shots: tuple[Shot, ...]) -> dict[str, object]:
    found: dict[str, object] = {"fixed": scene.camera.motion == "fixed"}
    if scene.camera.given or not scene.camera.calibration or scene.board is None:
        found |= {"matrix": camera.matrix.tolist(), "distortion": camera.distortion.tolist()}
    if scene.board is None:
        pose = next(shot.pose for shot in shots if shot.role == "sample")
        found |= {"rotation": pose.rotation.tolist(), "translation": pose.translation.tolist()}
    return found


def light_tables(scene: Scene, shots: tuple[Shot, ...]) -> list[dict[str, object]]:
    lamp = scene.lamp
    found: list[dict[str, object]] = []
    if lamp.attached_at is not None:
        place: dict[str, object] = {"position": list(lamp.attached_at)} if lamp.attached_given else {}
        found = [{"id": FLASH, "kind": "point", "attached_to": "camera"} | place]
    if not lamp.given:
        return found
    lamps = {s.lamps[0].id: s.lamps[0] for s in shots if s.role == "sample" and s.lamps[0].id != FLASH}
    scale = lamp_intensity(scene).max()
    key = "direction" if lamp.kind == "directional" else "position"
    return found + [
        {
            "id": i,
            "kind": a.kind,
            key: np.asarray(a.place).tolist(),
            "intensity": (a.intensity / scale).tolist(),
        }
        for i, a in lamps.items()
    ]


def photo_table(scene: Scene, shot: Shot) -> dict[str, object]:
    sensor = scene.sensor
    found: dict[str, object] = {"file": shot.file, "role": shot.role}
    optional: dict[str, object] = {"light": shot.light, "bracket": shot.bracket}
    if sensor.exposure is None or sensor.format not in WITH_EXIF:
        found["exposure_time"] = shot.exposure_time
        optional |= {"f_number": sensor.f_number, "iso": sensor.iso}
    return found | {k: v for k, v in optional.items() if v is not None}
