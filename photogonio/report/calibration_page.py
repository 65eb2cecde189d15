"""What calibration found, as sections of the report."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from photogonio.reconstruct.table.facet_table import LEFT_OUT, FacetTable
from photogonio.report.sections import Section, Table

if TYPE_CHECKING:
    from photogonio.calib.setup import Setup

_LIGHTS = (
    "Points in the board's frame and their standard error in its unit of length, or directions toward a distant light "
    "and theirs in radians. Residual: rms by which highlights in the mirror balls miss where they belong."
)
_LONGEST = 8  # numbers of a list that are shown


def calibration_sections(setup: Setup, table: FacetTable) -> tuple[Section, ...]:
    """Camera, lights, views, residuals, and the pixels left out by reason."""
    pixels = Section("Pixels of the sample left out", _pixels(table), "By photo and reason.", folded=True)
    return (*setup_sections(setup), pixels)


def setup_sections(setup: Setup) -> tuple[Section, ...]:
    """Camera, lights, views and residuals."""
    return (
        Section("Camera", _camera(setup)),
        Section("Lights", _lights(setup), _LIGHTS),
        Section("Photos used", _views(setup), folded=len(setup.views) > 12),
        Section("Residuals", Table(("what", "value"), list(_flat(setup.residuals))), folded=True),
    )


def _camera(setup: Setup) -> Table:
    k, (width, height) = setup.camera.matrix, setup.camera.size
    rows = [
        ("picture", f"{width} x {height} pixels"),
        ("focal length", f"{k[0, 0]:.2f}, {k[1, 1]:.2f} px"),
        ("principal point", f"{k[0, 2]:.2f}, {k[1, 2]:.2f} px"),
        ("distortion", ", ".join(f"{value:.5f}" for value in setup.camera.distortion) or "none"),
    ]
    if setup.falloff is not None:
        darker, error = setup.falloff.corner
        done = "allowed for" if setup.falloff.allowed else "not sure, not allowed for"
        rows.append(("light in the picture's corners", f"{darker:+.1%} +- {error:.1%}, {done}"))
    camera = setup.residuals.get("camera")
    if isinstance(camera, dict) and "rms_px" in camera:
        rows.append(("reprojection rms", f"{camera['rms_px']:.3f} px"))
    return Table(("what", "value"), rows)


def _lights(setup: Setup) -> Table:
    lights = {view.light.id: view.light for view in setup.views}
    rows = []
    for light in lights.values():
        near = light.kind == "point"
        place = ", ".join(f"{value:.1f}" if near else f"{value:.4f}" for value in light.place)
        error = float(np.sqrt(np.trace(light.covariance)))
        rows.append(
            (
                light.id,
                "near" if near else "distant",
                place,
                _figure(error),
                light.source,
                _figure(light.residual),
            )
        )
    return Table(("light", "kind", "place", "standard error", "found by", "residual, px"), rows)


def _views(setup: Setup) -> Table:
    rows = [
        (
            view.name,
            view.light.id,
            _figure(view.pose_rms),
            ", ".join(f"{value:.4g}" for value in view.strength),
            view.strength_source,
        )
        for view in setup.views
    ]
    return Table(("photo", "light", "board rms, px", "strength", "from"), rows)


def _pixels(table: FacetTable) -> Table:
    used = np.bincount(table.group, weights=table.count, minlength=len(table.groups))
    rows = [
        (name, f"{used[k]:.0f}", *(str(int(count)) for count in counts))
        for k, (name, counts) in enumerate(zip(table.groups, table.left_out, strict=False))
    ]
    return Table(("photo", "used", *LEFT_OUT), rows)


def _figure(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "–"


def _flat(value: object, path: str = "") -> Iterator[tuple[str, str]]:
    """Nested plain values as rows of (path, text)."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from _flat(item, f"{path} / {key}" if path else str(key))
    elif isinstance(value, (list, tuple)) and any(isinstance(item, (dict, list, tuple)) for item in value):
        for k, item in enumerate(value):
            yield from _flat(item, f"{path} [{k}]")
    elif isinstance(value, (list, tuple)):
        more = ", …" if len(value) > _LONGEST else ""
        yield path, ", ".join(_text(item) for item in value[:_LONGEST]) + more
    else:
        yield path, _text(value)


def _text(value: object) -> str:
    if isinstance(value, float):
        return _figure(value)
    return "–" if value is None else str(value)
