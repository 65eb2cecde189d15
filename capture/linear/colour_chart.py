"""From camera RGB to CIE XYZ or linear sRGB, by a 24-patch ColorChecker found in a photo.

The chart is found by OpenCV's mcc module; its colours are colour-science's for charts made after November
2014, under D50. Both sides are relative to a perfect white, so that the matrix also takes a BRDF's
channels.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from scipy.optimize import least_squares

from photogonio.capture.errors import InputError
from photogonio.capture.linear.colour_library import colour_science
from photogonio.capture.linear.reader import RadianceReader

CHART = "ColorChecker24 - After November 2014"
ROWS, COLUMNS = 4, 6
PATCH_SHARE = 0.4  # of a patch's width that is averaged
WHITE_PERCENTILES = (99.9, 99.0, 95.0)  # what the detector is shown as white
WORST_COST = 0.03  # of OpenCV's detector; wrong charts cost more
WORST_DELTA_E = 12.0  # mean, beyond which it is not this chart


@dataclass(frozen=True, slots=True)
class ColourCorrection:
    """``xyz = matrix @ (rgb / white)``: camera RGB to XYZ, both relative to a perfect white under D50.

    The errors are those of ``matrix @ ((rgb - offset) / white)``: the lens's glare, or a wrong black level,
    adds an offset that belongs to the chart's photo and to no other.
    """

    matrix: np.ndarray  # (3, 3)
    white: np.ndarray  # (3,) camera RGB of a perfect white where the chart stood
    offset: np.ndarray  # (3,) camera RGB of a perfect black there
    delta_e: np.ndarray  # (24,) CIE Delta E 2000 of the patches after correction
    delta_e_left_out: np.ndarray  # (24,) likewise, each patch left out of the fit

    def xyz(self, rgb: np.ndarray) -> np.ndarray:
        """XYZ (..., 3) under D50, white's Y is 1, of camera RGB (..., 3)."""
        return (rgb / self.white) @ self.matrix.T

    def srgb(self, rgb: np.ndarray) -> np.ndarray:
        """Linear sRGB (..., 3), white adapted from D50 to D65 by Bradford's transform, of camera RGB (...,
        3).
        """
        return self.xyz(rgb) @ srgb_from_xyz().T


def find_chart(value: np.ndarray) -> np.ndarray:
    """Corners (4, 2) in pixels of a 24-patch chart in linear RGB (h, w, 3). Raises ValueError if none is
    found.

    The order of the corners is the detector's: :func:`correct` tries all four turns.
    """
    best_cost, best = WORST_COST, None
    for percentile in WHITE_PERCENTILES:
        tone = np.clip(value / max(float(np.percentile(value, percentile)), 1e-12), 0, 1) ** (1 / 2.2)
        picture = np.ascontiguousarray((tone[..., ::-1] * 255).astype(np.uint8))
        detector = cv2.mcc.CCheckerDetector.create()
        detector.setColorChartType(cv2.mcc.MCC24)
        cv2.setRNGSeed(0)  # it clusters from random starts
        if detector.process(picture, 3):
            for chart in detector.getListColorChecker():
                if chart.getCost() < best_cost:
                    best_cost, best = chart.getCost(), np.asarray(chart.getBox(), float)
    if best is None:
        raise ValueError("no 24-patch ColorChecker found")
    return best


def patch_means(value: np.ndarray, corners: np.ndarray, valid: np.ndarray | None = None) -> np.ndarray:
    """Mean linear RGB (24, 3) of the middle of each patch, row by row from the first corner; NaN where no
    pixel
    is valid."""
    unit = np.array([[0, 0], [COLUMNS, 0], [COLUMNS, ROWS], [0, ROWS]], np.float32)
    place = cv2.getPerspectiveTransform(unit, corners.astype(np.float32))
    means = np.full((ROWS * COLUMNS, value.shape[2]), np.nan)
    half = PATCH_SHARE / 2
    square = np.array([[-half, -half], [half, -half], [half, half], [-half, half]])
    for k in range(ROWS * COLUMNS):
        outline = np.add(square, (k % COLUMNS + 0.5, k // COLUMNS + 0.5))
        pixels = cv2.perspectiveTransform(outline[None].astype(np.float32), place)[0]
        mask = np.zeros(value.shape[:2], np.uint8)
        cv2.fillConvexPoly(mask, np.round(pixels).astype(np.int32), 1)
        inside = mask.astype(bool) if valid is None else mask.astype(bool) & valid
        if inside.any():
            means[k] = value[inside].mean(axis=0, dtype=float)
    return means


def correct(measured: np.ndarray) -> ColourCorrection:
    """The matrix for measured patches (24, 3); the chart may be upside down.

    Raises ValueError if they are no such chart's.
    """
    if not np.isfinite(measured).all():
        raise ValueError("some patch of the chart has no valid pixel")
    reference = reference_xyz()
    found = []
    for patches in (measured, measured[::-1]):
        solution = solve(patches, reference)
        found.append((float(delta_e_2000(predict(solution, patches), reference).mean()), patches, solution))
    mean, patches, solution = min(found, key=lambda entry: entry[0])
    if not mean <= WORST_DELTA_E:
        raise ValueError(f"the patches fit no ColorChecker (mean Delta E 2000 {mean:.1f})")
    return correction_of(solution, patches, reference)


def correction_of(solution: np.ndarray, patches: np.ndarray, reference: np.ndarray) -> ColourCorrection:
    """The result in terms of white, with its errors on the patches and on those left out one by one."""
    left_out = np.empty(len(patches))
    for k in range(len(patches)):
        others = np.arange(len(patches)) != k
        without = solve(patches[others], reference[others], solution)
        left_out[k] = delta_e_2000(predict(without, patches[k]), reference[k])
    white = np.linalg.solve(solution[:, :3], white_xyz())
    return ColourCorrection(
        solution[:, :3] * white,
        white,
        solution[:, 3],
        delta_e_2000(predict(solution, patches), reference),
        left_out,
    )


def predict(solution: np.ndarray, rgb: np.ndarray) -> np.ndarray:
    """XYZ (..., 3) by a solution (3, 4): matrix and, in camera RGB, offset."""
    return (rgb - solution[:, 3]) @ solution[:, :3].T


def solve(rgb: np.ndarray, reference: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
    """Matrix and offset (3, 4) that take RGB (n, 3) to XYZ (n, 3) with the least squared Delta E 1976."""
    if start is None:
        design = np.column_stack([rgb, np.ones(len(rgb))])
        affine = np.linalg.lstsq(design, reference, rcond=None)[0].T
        start = np.column_stack([affine[:, :3], -np.linalg.solve(affine[:, :3], affine[:, 3])])
    target, scale = lab(reference), np.abs(start)
    scale[:, 3] = np.abs(rgb).mean(axis=0)

    def residual(entries: np.ndarray) -> np.ndarray:
        return (lab(predict(entries.reshape(3, 4), rgb)) - target).ravel()

    found = least_squares(residual, start.ravel(), x_scale=np.maximum(scale, 1e-9).ravel())
    return found.x.reshape(3, 4)


def lab(xyz: np.ndarray) -> np.ndarray:
    """CIE Lab (..., 3) under D50 of XYZ (..., 3); linear below, so that negative values have a slope too."""
    ratio = np.asarray(xyz) / white_xyz()
    root = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def delta_e_2000(xyz: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """CIE Delta E 2000 (...) by colour-science."""
    colour = colour_science()

    return colour.delta_E(lab(xyz), lab(reference), method="CIE 2000")


@cache
def reference_xyz() -> np.ndarray:
    """XYZ (24, 3) of the chart under D50, white's Y is 1."""
    colour = colour_science()

    return colour.xyY_to_XYZ(np.array(list(colour.CCS_COLOURCHECKERS[CHART].data.values())))


@cache
def white_xyz() -> np.ndarray:
    """XYZ of D50, Y = 1, from the chart's chromaticity of white."""
    colour = colour_science()

    return colour.xy_to_XYZ(colour.CCS_COLOURCHECKERS[CHART].illuminant)


def srgb_from_xyz() -> np.ndarray:
    """(3, 3) from XYZ under D50 to linear sRGB."""
    colour = colour_science()

    illuminant = colour.CCS_COLOURCHECKERS[CHART].illuminant
    columns = colour.XYZ_to_RGB(np.eye(3), "sRGB", illuminant, "Bradford")
    return np.asarray(columns).T


def colour_correction(reader: RadianceReader) -> ColourCorrection | None:
    """From the set's photos with role "chart": the first in which a chart is found and fits; None without
    any.

    Raises InputError, with the last photo's reason, if none will do.
    """
    views = reader.photoset.views("chart")
    for view in views:
        try:
            image = reader.read(view)
            if image.value.shape[2] != 3:
                raise ValueError(f"colour correction needs 3 channels, not {image.value.shape[2]}")
            return correct(patch_means(image.value, find_chart(image.value), image.valid))
        except ValueError as error:  # InputError is one too
            reason = error.what if isinstance(error, InputError) else str(error)
    if views:
        raise InputError(reader.photoset.folder / views[-1].name, reason)
    return None
