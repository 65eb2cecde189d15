"""What a calibration found, in lines for the screen: every quantity with its standard error."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from photogonio.calib.setup import Light, Setup


def calibration_lines(setup: Setup) -> str:
    return "\n".join([*_camera(setup), *_sample(setup), *_lights(setup), *_views(setup)])


def _camera(setup: Setup) -> Iterator[str]:
    told = setup.residuals.get("camera")
    told = told if isinstance(told, dict) else {}
    errors = told.get("standard_errors", {})
    matrix, lens = setup.camera.matrix, setup.camera.distortion
    values = dict(zip(("fx", "fy", "cx", "cy"), matrix[[0, 1, 0, 1], [0, 1, 2, 2]], strict=True))
    values |= {f"distortion[{k}]": value for k, value in enumerate(lens)}
    found = f"model {told['model']}, rms {told['rms_px']:.3f} px" if "model" in told else "given"
    yield f"camera: {found}"
    for name, value in values.items():
        yield f"  {name:14}{_with_error(value, errors.get(name))}"
    if "corner_error_px" in told:
        yield f"  a point at the picture's corner is sure to {told['corner_error_px']:.3f} px"
    if setup.falloff is not None:
        darker, error = (100 * value for value in setup.falloff.corner)
        done = "allowed for" if setup.falloff.allowed else "not allowed for"
        yield f"  light in the picture's corners {_with_error(darker, error)} % ({done})"


def _sample(setup: Setup) -> Iterator[str]:
    told = setup.residuals.get("sample")
    if isinstance(told, dict):
        pairs = zip(told["shift"], told["shift_error"], strict=True)
        shift = ", ".join(_with_error(value, error) for value, error in pairs)
        radius = ""
        if "radius_change" in told:  # a ball's
            radius = f"; radius by {_with_error(told['radius_change'], told['radius_error'])}"
        yield f"sample moved by {shift}{radius}"


def _lights(setup: Setup) -> Iterator[str]:
    yield "lights:"
    for light in {view.light.id: view.light for view in setup.views}.values():
        errors = np.sqrt(np.maximum(np.diag(light.covariance), 0.0))
        place = ", ".join(_with_error(value, error) for value, error in zip(light.place, errors, strict=True))
        yield f"  {light.id}: {_kind(light)} {place} ({light.source}; miss {_figure(light.residual)} px)"


def _kind(light: Light) -> str:
    return "direction" if light.kind == "directional" else "at"


def _views(setup: Setup) -> Iterator[str]:
    yield f"photos (scale {setup.scale}):"
    for view in setup.views:
        stand = "camera given"
        if view.pose_covariance is not None:
            rotation = view.pose.rotation
            spread = rotation.T @ view.pose_covariance[3:, 3:] @ rotation
            stand = f"camera's place sure to {_figure(float(np.sqrt(np.trace(spread) / 3)))}"
        strength = ", ".join(f"{value:.5g}" for value in view.strength)
        error = 100 * float(np.max(view.strength_error / view.strength))
        yield (
            f"  {view.name}: board {_figure(view.pose_rms)} px, {stand}; "
            f"strength {strength} +- {error:.2g} % ({view.strength_source})"
        )


def _with_error(value: float, error: float | None) -> str:
    if error is None or not np.isfinite(error) or error == 0:
        return f"{value:.6g}"
    places = max(0, 1 - int(np.floor(np.log10(error))))
    return f"{value:.{places}f} +- {error:.{places}f}"


def _figure(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "-"
