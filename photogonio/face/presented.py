"""What every BRDF in Python can do, wherever it comes from: be compared, drawn, exported, and shown in a notebook."""

from __future__ import annotations

import base64
import html
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from photogonio.capture.errors import InputError
from photogonio.compare.compare import Comparison, compare
from photogonio.compare.known import Known
from photogonio.compare.reflectances import find_brdf, load_known
from photogonio.face.directions import checked_directions
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.report.ball import BALL_LIGHTS, shaded_sphere, to_display
from photogonio.report.html import image_bytes
from photogonio.report.plots import overview_figure
from photogonio.system.outputs import staged

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

STEP, TURN = 5.0, 15.0  # degrees between the nodes of an array
LAST = 85.0  # degrees: at 90 many BRDFs have no finite value
BALL = 112  # pixels
LIGHT = np.radians(45.0)  # from the normal, in the drawing of a lobe


class Presented:
    """Methods that need no more than f, the channels' names, and a few lines of text."""

    __slots__ = ()

    channels: tuple[str, ...]

    def _known(self) -> Known:
        """As a comparison takes it."""
        raise NotImplementedError

    def _lines(self) -> list[str]:
        """Five lines about it."""
        raise NotImplementedError

    def compare(
        self, other: Presented | str | Path, *, mask: float = np.radians(80.0), scale: bool = False
    ) -> Comparison:
        """How far this is from the reference ``other``, a BRDF or its file or folder (docs/metrics.md).

        Only pairs with both angles below ``mask`` (radians) count; with ``scale`` one factor a channel is free. Raises
        InputError where they cannot be compared.
        """
        if not isinstance(other, Presented | str | Path):
            raise InputError("compare", f"a BRDF, or its file or folder, is needed, not {other!r:.60}")
        number = isinstance(mask, int | float | np.number) and not isinstance(mask, bool)
        if not (number and 0.0 < mask <= 0.5 * np.pi):
            raise InputError("mask", f"an angle in radians is needed, up to pi / 2, not {mask!r:.60}")
        reference = other._known() if isinstance(other, Presented) else load_known(find_brdf(Path(other)))
        return compare(self._known(), reference, mask=mask, scale=scale)

    def plot(self) -> Figure:
        """Lobes, cuts and balls under three lights, as a figure of matplotlib."""
        known = self._known()
        if known.evaluate is None:
            raise InputError(known.name, "is known at single pairs of directions only; fit it first")
        return overview_figure(known.evaluate, self.channels, self._lines()[0])

    def to_xarray(self) -> xarray.Dataset:
        """f and its standard error, 1/sr, on a grid of angles in degrees, by channel.

        Raises ImportError where the optional package xarray is absent, InputError where f is not known everywhere.
        """
        try:
            import xarray
        except ImportError as absent:
            raise ImportError(
                "to_xarray needs the package xarray: pip install 'photogonio[xarray]'"
            ) from absent
        polar = np.arange(0.0, LAST + 1.0, STEP)
        known = self._known()
        turn = np.arange(0.0, 181.0 if known.isotropic else 359.0, TURN)
        axes = {"theta_i": polar, "theta_r": polar, "dphi": turn}
        if not known.isotropic:
            axes["phi_i"] = np.arange(0.0, 359.0, TURN)
        grids = np.meshgrid(*(np.radians(axis) for axis in axes.values()), indexing="ij")
        theta_i, theta_r, dphi = grids[:3]
        phi_i = np.zeros_like(dphi) if known.isotropic else grids[3]
        f, error = self._on_grid(theta_i, phi_i, theta_r, phi_i + dphi)
        names = (*axes, "channel")
        return xarray.Dataset(
            {"f": (names, f, {"units": "1/sr"}), "standard_error": (names, error, {"units": "1/sr"})},
            coords={
                **{name: (name, axis, {"units": "degrees"}) for name, axis in axes.items()},
                "channel": list(self.channels),
            },
        )

    def _on_grid(self, theta_i, phi_i, theta_r, phi_r) -> tuple[np.ndarray, np.ndarray]:
        """f and its standard error (..., c) at angles (...), radians."""
        f = self._f(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r))
        error = getattr(self, "standard_error", None)
        return f, np.full_like(f, np.nan) if error is None else error(theta_i, phi_i, theta_r, phi_r)

    def _f(self, incident: ArrayLike, exit: ArrayLike) -> np.ndarray:
        """f (..., c), 1/sr, at unit vectors (..., 3)."""
        known = self._known()
        if known.evaluate is None:
            raise InputError(known.name, "is known at single pairs of directions only; fit it first")
        incident, exit = np.broadcast_arrays(*checked_directions(incident, exit))
        shape = incident.shape[:-1]
        incident, exit = (_of_length_one(one.reshape(-1, 3)) for one in (incident, exit))
        above = (incident[:, 2] >= 0.0) & (exit[:, 2] >= 0.0)
        value = np.zeros((above.size, len(self.channels)))
        value[above] = known.evaluate(incident[above], exit[above])
        value[np.isnan(incident[:, 2] + exit[:, 2])] = np.nan
        return value.reshape(*shape, len(self.channels))

    def _export(self, source: Any, format: str, path: Path, order: int | None) -> str:
        form = find_format(format)
        if order is not None and (isinstance(order, bool) or not isinstance(order, int | np.integer)):
            raise InputError("order", f"a whole number is needed, not {order!r:.60}")
        if order is not None and not form.ordered:
            raise InputError(f"order {order}", f"{format} holds no modes")
        if not path.parent.is_dir():
            raise InputError(path, f"there is no folder {path.parent}")
        asked: dict[str, Any] = {} if order is None else {"order": order}
        with staged(path, folder=form.folder) as stage:
            remark, loss = form.put(source, stage, **asked)
        return "; ".join(str(one) for one in (remark, loss) if one)

    def _only_place(self, channel: str, channels: tuple[str, ...]) -> int:
        if channel not in channels:
            raise InputError(f"channel {channel}", f"expected one of {', '.join(channels)}")
        return channels.index(channel)

    def _repr_html_(self) -> str:
        """A small card: what it is, a lobe at 45 degrees, and a ball."""
        first, *rest = (html.escape(line) for line in self._lines())
        text = f"<b>{first}</b><br>" + "<br>".join(rest)
        pictures = ""
        if self._known().evaluate is not None:
            pictures = f"<div>{self._lobe()}{self._ball()}</div>"
        return (
            '<div style="display:flex;gap:1em;align-items:center;font:13px/1.5 sans-serif;border:1px solid #c8ccd2;'
            f'border-radius:6px;padding:.7em 1em;max-width:52em"><div>{text}</div>{pictures}</div>'
        )

    def _ball(self) -> str:
        picture = to_display(
            shaded_sphere(self._f, BALL_LIGHTS["over the shoulder"], size=BALL), background=1.0
        )
        png = base64.b64encode(image_bytes(picture)).decode()
        return f'<img alt="ball" width="{BALL}" height="{BALL}" src="data:image/png;base64,{png}">'

    def _lobe(self) -> str:
        """f in the plane of incidence as a curve about the point of incidence, its length by the square root."""
        theta = np.radians(np.linspace(-88.0, 88.0, 89))
        exit = unit_vectors(np.abs(theta), np.where(theta < 0.0, 0.0, np.pi))
        f = np.maximum(self._f(np.broadcast_to(unit_vectors(LIGHT, 0.0), exit.shape), exit).mean(-1), 0.0)
        length = 92.0 * np.sqrt(f / max(float(f.max()), np.finfo(float).tiny))
        points = " ".join(
            f"{100 + r * np.sin(t):.1f},{104 - r * np.cos(t):.1f}" for r, t in zip(length, theta, strict=True)
        )
        tip = f"{100 - 96 * np.sin(LIGHT):.1f}"
        return (
            f'<svg width="{2 * BALL}" height="{BALL}" viewBox="0 0 200 112" role="img" aria-label="lobe">'
            '<line x1="4" y1="104" x2="196" y2="104" stroke="#24292f"/>'
            f'<line x1="{tip}" y1="{104 - 96 * np.cos(LIGHT):.1f}" x2="100" y2="104" stroke="#d9822b" '
            'stroke-dasharray="4 3"/>'
            f'<polygon points="100,104 {points}" fill="#c8ccd2" stroke="#24292f"/></svg>'
        )


def _of_length_one(vectors: np.ndarray) -> np.ndarray:
    """(n, 3) of vectors that have a length."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
