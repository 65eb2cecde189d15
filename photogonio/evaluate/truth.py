"""A rendered set's truth beside what was found: errors of the calibration."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.files.documents import read_json
from photogonio.capture.manifest.schema import array, number, text
from photogonio.capture.photoset import Plane
from photogonio.synthetic.write.truth import FORMAT

TRUTH = "truth.json"


@dataclass(frozen=True, slots=True)
class CalibrationError:
    """Medians over the views that were used; lengths in the set's unit. NaN: does not apply."""

    focal: float  # relative
    camera: float  # of the camera's place
    light: float  # of the lamp's direction as seen from the sample, degrees
    light_place: float  # of a near lamp's place, relative to its distance from the sample
    strength: float  # of the lamp's strength, relative; the channel farthest off
    sample: float  # of a ball's centre

    def to_dict(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in self.__slots__}


def load_truth(folder: Path) -> dict:
    """The truth of a rendered set.

    Raises:
        InputError: there is none, or not whole.
    """
    path = folder / TRUTH
    truth = read_json(path)
    if not isinstance(truth, dict) or truth.get("format") != FORMAT:
        raise InputError(path, f'expected "format": "{FORMAT}"')
    number(above=0.0)(truth.get("radiance_scale"), f"{path}: radiance_scale")
    camera, photos = truth.get("camera"), truth.get("photos")
    if not isinstance(camera, dict) or not isinstance(photos, list):
        raise InputError(path, "expected camera and photos")
    array(3, 3)(camera.get("matrix"), f"{path}: camera matrix")
    for k, photo in enumerate(photos):
        _check_photo(photo, f"{path}: photos[{k}]")
    return truth


def _check_photo(photo: object, where: str) -> None:
    if not isinstance(photo, dict):
        raise InputError(where, "expected a photo with its lights")
    lights = photo.get("lights")
    if not isinstance(lights, list) or not all(isinstance(light, dict) for light in lights):
        raise InputError(where, "expected a photo with its lights")
    text(photo.get("file"), f"{where} file")
    array(3, 3)(photo.get("rotation"), f"{where} rotation")
    array(3)(photo.get("translation"), f"{where} translation")
    for light in lights:
        array(3)(light.get("position", light.get("direction")), f"{where} light")
        array(None)(light.get("strength"), f"{where} strength")
    if "sample_center" in photo:
        array(3)(photo["sample_center"], f"{where} sample_center")


def calibration_error(setup: Setup, truth: dict) -> CalibrationError:
    """How far ``setup`` is from the truth of its set."""
    photos = {photo["file"]: photo for photo in truth["photos"]}
    rows = [view_errors(setup, view, photos[view.name], truth["radiance_scale"]) for view in setup.views]
    camera, light, place, strength, sample = (_median(column) for column in zip(*rows, strict=True))
    true_focal, focal = truth["camera"]["matrix"][0][0], setup.camera.matrix[0, 0]
    return CalibrationError(abs(focal / true_focal - 1.0), camera, light, place, strength, sample)


def view_errors(setup: Setup, view: ViewSetup, photo: dict, scale: float) -> tuple[float, ...]:
    """Of one view, in the order of :class:`CalibrationError`'s fields after the first; ``photo`` is its truth."""
    rotation, translation = np.array(photo["rotation"]), np.array(photo["translation"])
    camera = float(np.linalg.norm(view.pose.center + rotation.T @ translation))
    lamp = photo["lights"][0]
    near = "position" in lamp
    middle = _middle(setup, photo)
    true_place = np.array(lamp["position"] if near else lamp["direction"])
    true_toward = true_place - middle if near else true_place
    toward = view.light.toward(middle[None])[0][0]
    distance = float(np.linalg.norm(true_toward))
    cosine = np.clip(toward @ true_toward / distance, -1.0, 1.0)
    place = float("nan")
    if near and view.light.kind == "point":
        place = float(np.linalg.norm(view.light.place - true_place)) / distance
    # what reaches the sample is what counts, so that a near lamp and a distant one can be compared
    reaching = view.strength * view.light.toward(middle[None])[1][0]
    true_reaching = np.array(lamp["strength"]) * scale / (distance**2 if near else 1.0)
    strength = float(np.max(np.abs(reaching / true_reaching - 1.0)))
    sample = float("nan")
    if "sample_center" in photo:
        sample = float(np.linalg.norm(setup.ball.center - np.array(photo["sample_center"])))
    return camera, float(np.degrees(np.arccos(cosine))), place, strength, sample


def _middle(setup: Setup, photo: dict) -> np.ndarray:
    if "sample_center" in photo:
        return np.array(photo["sample_center"])
    sample = setup.sample
    return np.append(sample.outline.mean(0), sample.height) if isinstance(sample, Plane) else sample.center


def _median(values: tuple[float, ...]) -> float:
    finite = [value for value in values if np.isfinite(value)]
    return float(np.median(finite)) if finite else float("nan")
