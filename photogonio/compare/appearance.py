"""What the eye would see: shaded balls of two BRDFs, and their colour differences (colour-science)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from photogonio.capture.linear.colour_library import colour_science
from photogonio.report.ball import BALL_LIGHTS, shaded_sphere, to_display

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]

_SIZE = 160  # pixels across a ball
_WHITE_LUMINANCE = 203.0  # cd/m2 of reference white, ITU-R BT.2408
_WHITE_QUANTILE = 0.98  # of the reference's pixels: mapped to white, one exposure for all lights


@dataclass(frozen=True, slots=True)
class Appearance:
    """Both balls under each light, and how different they look."""

    a: np.ndarray  # (lights, h, w, 3) linear RGB, 1 is white, NaN beside the ball
    b: np.ndarray
    delta_e_itp: np.ndarray  # (lights, h, w)
    delta_e_2000: np.ndarray  # (lights, h, w)
    psnr: float  # dB, of sRGB values over the balls' pixels

    def to_dict(self) -> dict[str, float]:
        numbers = {"psnr": self.psnr}
        for name in ("delta_e_itp", "delta_e_2000"):
            values = getattr(self, name)
            numbers[f"{name}_mean"] = float(np.nanmean(values))
            numbers[f"{name}_95"] = float(np.nanquantile(values, 0.95))
        return numbers

    def figure(self, names: tuple[str, str]) -> Figure:
        """Both balls under each light, and where they differ."""
        figure = Figure(figsize=(2.4 * len(BALL_LIGHTS), 7.4), layout="constrained")
        axes = figure.subplots(3, len(BALL_LIGHTS), squeeze=False)
        top = max(2.0, float(np.nanquantile(self.delta_e_itp, 0.99)))
        for column, light in zip(axes.T, range(len(BALL_LIGHTS)), strict=True):
            for ax, ball in zip(column, (self.a[light], self.b[light]), strict=False):
                ax.imshow(to_display(ball, white=1.0, background=1.0), interpolation="antialiased")
            shown = column[2].imshow(self.delta_e_itp[light], vmin=0, vmax=top, cmap="magma")
        for ax in axes.flat:
            ax.set_axis_off()
        for row, name in zip(axes, (*names, "Delta E ITP"), strict=True):
            row[0].set_title(name, fontsize=10, loc="left")
        figure.colorbar(shown, ax=axes[2], location="bottom", shrink=0.5, aspect=40)
        return figure


def appearance(judged: Evaluate, reference: Evaluate, channels: Sequence[str]) -> Appearance:
    """Shade balls of both with :data:`BALL_LIGHTS` at one exposure and compare them pixel by pixel.

    Channels R, G, B (or any three) are taken as linear sRGB; any other number as their mean, grey.
    """
    a, b = (_balls(evaluate, channels) for evaluate in (judged, reference))
    white = float(np.nanquantile(b, _WHITE_QUANTILE))
    a, b = np.maximum(a, 0.0) / white, np.maximum(b, 0.0) / white
    inside = np.isfinite(b[..., 0])
    itp, lab = (np.full(inside.shape, np.nan) for _ in range(2))
    itp[inside] = difference_itp(a[inside], b[inside])
    lab[inside] = _delta_e_2000(a[inside], b[inside])
    return Appearance(a, b, itp, lab, _psnr(a[inside], b[inside]))


def _balls(evaluate: Evaluate, channels: Sequence[str]) -> np.ndarray:
    balls = np.stack([shaded_sphere(evaluate, light, size=_SIZE) for light in BALL_LIGHTS.values()])
    if {"R", "G", "B"} <= set(channels):
        return balls[..., [list(channels).index(name) for name in "RGB"]]
    if balls.shape[-1] == 3:
        return balls
    return np.repeat(balls.mean(-1, keepdims=True), 3, -1)


def difference_itp(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Delta E ITP (ITU-R BT.2124) of linear sRGB, white at :data:`_WHITE_LUMINANCE`."""
    colour = colour_science()

    wide = colour.matrix_RGB_to_RGB(colour.RGB_COLOURSPACES["sRGB"], colour.RGB_COLOURSPACES["ITU-R BT.2020"])
    one, other = (colour.RGB_to_ICtCp(np.maximum(x @ wide.T, 0.0) * _WHITE_LUMINANCE) for x in (a, b))
    return colour.delta_E(one, other, method="ITP")


def _delta_e_2000(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """CIEDE2000 of linear sRGB clipped to the display's range."""
    colour = colour_science()

    space = colour.RGB_COLOURSPACES["sRGB"]
    one, other = (
        colour.XYZ_to_Lab(np.clip(x, 0.0, 1.0) @ space.matrix_RGB_to_XYZ.T, space.whitepoint) for x in (a, b)
    )
    return colour.delta_E(one, other, method="CIE 2000")


def _psnr(a: np.ndarray, b: np.ndarray) -> float:
    """Peak signal to noise ratio of the displayed (sRGB, clipped) pixels, dB; infinite if equal."""
    colour = colour_science()

    shown = [colour.cctf_encoding(np.clip(x, 0.0, 1.0), function="sRGB") for x in (a, b)]
    error = float(np.mean((shown[0] - shown[1]) ** 2))
    return float("inf") if error == 0 else -10.0 * np.log10(error)
