"""Renders the pictures of guide.md: `python -m docs.guide_pictures` in the project's folder (a minute)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.synthetic.render.sensor import expose
from photogonio.synthetic.render.world import brdf_of
from photogonio.synthetic.scene.hard_cases import changed
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.plan import camera_of, exposure_factor, look_at, plan
from photogonio.synthetic.scene.scene import load_scene
from photogonio.synthetic.write.photoset import view_radiance

IMAGES = Path(__file__).parent / "images"
MIDDLE = np.array([90.0, 70.0, 25.0])
EYE = np.array([-180.0, -120.0, 330.0])  # of the phone, in the picture from aside
LAMP = np.array([300.0, 150.0, 270.0])
ASIDE = np.array([250.0, -980.0, 460.0])  # from where it is seen
PAPER, INK, GLOW, CASE = (252, 250, 244), (40, 40, 46), (255, 214, 96), (64, 70, 84)
# corners of a phone as its lens sees them: x to the right, y down, z forward
PHONE = np.array([[-12, -12, 0], [62, -12, 0], [62, 136, 0], [-12, 136, 0]], float)


def main() -> None:
    scene = guide_scene()
    write("guide-aside.jpg", from_aside(scene))
    write("guide-good.jpg", photo(scene, look_at(EYE, MIDDLE)))
    write(
        "guide-bad.jpg",
        photo(spoilt(scene), look_at(0.5 * (EYE + MIDDLE), MIDDLE + np.array([45.0, 20.0, 0.0]))),
    )


def guide_scene() -> Scene:
    """A ball of satin paint on the sheet, and a torch."""
    scene = changed(
        load_scene("phone-plane"),
        sample={"shape": "sphere", "center": tuple(MIDDLE), "radius": 25.0},
        camera={"size": (720, 480), "focal": 1000.0, "shading": None},
        lamp={"places": (tuple(LAMP),), "attached_at": None},
        sensor={"encoding": "srgb", "exposure": None, "level": 1.3},
        render={"near": 2, "edge": 4},
    )
    return replace(scene, brdf={"model": "satin-paint", "albedo": [0.5, 0.2, 0.12], "roughness": 0.3})


def spoilt(scene: Scene) -> Scene:
    """Out of focus, overexposed."""
    return changed(scene, camera={"defocus": 2.5}, sensor={"level": 4.0})


def photo(scene: Scene, pose: Pose, camera: Camera | None = None) -> np.ndarray:
    """What a camera at a pose takes, (h, w, 3) uint8."""
    camera = camera or camera_of(scene)
    shot = replace(next(shot for shot in plan(scene) if shot.role == "sample"), pose=pose)
    radiance = view_radiance(scene, camera, brdf_of(scene), shot)
    return expose(scene, camera, radiance, shot.exposure_time, exposure_factor(scene), (0, 0))


def from_aside(scene: Scene) -> np.ndarray:
    """The scene, with phone and lamp drawn where they are."""
    camera = Camera(np.array([[900.0, 0, 360], [0, 900.0, 270], [0, 0, 1]]), np.zeros(5), (720, 540))
    pose = look_at(ASIDE, MIDDLE + np.array([-20.0, 0.0, 105.0]))
    picture = np.ascontiguousarray(photo(scene, pose, camera))
    phone = look_at(EYE, MIDDLE).inverse().apply(PHONE)

    def at(*points: np.ndarray) -> np.ndarray:
        return np.round(camera.project(pose, np.array(points))).astype(np.int32)

    lens, lamp, ball = at(EYE, LAMP, MIDDLE)
    for place, colour in ((lens, (150, 190, 255)), (lamp, GLOW)):
        cv2.line(picture, place, ball, colour, 2, cv2.LINE_AA)
    for foot in (EYE, LAMP):
        start, end = at(foot, foot * [1, 1, 0])
        cv2.line(picture, start, end, (120, 120, 128), 1, cv2.LINE_AA)
    cv2.fillPoly(picture, [at(*phone)], CASE, cv2.LINE_AA)
    cv2.polylines(picture, [at(*phone)], True, (190, 196, 210), 2, cv2.LINE_AA)
    cv2.circle(picture, lens, 6, INK, -1, cv2.LINE_AA)
    cv2.circle(picture, lamp, 14, GLOW, -1, cv2.LINE_AA)
    for word, thing, beside in (
        ("phone", lens, (22, -12)),
        ("lamp", lamp, (22, 6)),
        ("sample", ball, (34, 6)),
    ):
        place = np.add(thing, beside)
        for colour, thick in ((INK, 4), (PAPER, 1)):
            cv2.putText(picture, word, place, cv2.FONT_HERSHEY_SIMPLEX, 0.6, colour, thick, cv2.LINE_AA)
    return picture


def write(name: str, picture: np.ndarray) -> None:
    path = IMAGES / name
    if not cv2.imwrite(str(path), picture[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 85]):
        raise OSError(f"{path}: could not be written")


if __name__ == "__main__":
    main()
