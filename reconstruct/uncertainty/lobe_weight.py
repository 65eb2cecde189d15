"""How much of the surface a mirror lobe covers, which the fit takes as all of it.

A lobe on an absolute scale has weight 1: its Fresnel term alone says how bright it is. At steep incidence half a
surface of index 1.5 looks like a whole one of index 1.34, and two lobes like one of another base reflectance; they part
where F rises toward grazing. So the logarithm of the weight is a further parameter of the linearised fit, whose
deviation before the data is that of materials: small where the base reflectance found is one of a bulk, larger the less
likely it is.
"""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.lobes.families import Family
from photogonio.reconstruct.table.cells import Cells

BULK_F0 = 0.043  # of plastics, lacquers, glasses: index 1.42 to 1.62, the middle
BULK_SPREAD = 0.2  # of its logarithm
METAL_F0 = 0.5  # from here on of a metal, in its brightest channel
PARTIAL = 0.03  # share of surfaces of which a lobe covers but a part, or is several
PARTIAL_SPREAD = 0.5  # of the logarithm of that part


def cover_slopes(model: Model, cells: Cells) -> np.ndarray:
    """(n, k, c) change of f with one standard deviation of the weight's logarithm of each lobe of weight 1."""
    slopes, start = [], 0
    for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True):
        own = model.lobe_coefficients[start : start + len(family.coefficient_names)]
        start += len(own)
        if not family.absolute:
            continue
        fixed, columns = LobeSet((family,), (shape,)).columns(cells)
        mirror = fixed[:, None] + (0.0 if family.has_ground else 1.0) * columns @ own
        slopes.append(_cover(family, shape, own) * mirror)
    return np.stack(slopes, axis=1) if slopes else np.empty((len(cells), 0, model.lobe_coefficients.shape[1]))


def covers_of(model: Model) -> list[float]:
    """Standard deviations of the weights' logarithms of the lobes of weight 1, in their order."""
    covers, start = [], 0
    for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True):
        own = model.lobe_coefficients[start : start + len(family.coefficient_names)]
        start += len(own)
        if family.absolute:
            covers.append(_cover(family, shape, own))
    return covers


def _cover(family: Family, shape: np.ndarray, own: np.ndarray) -> float:
    return _spread(float(shape[1]) if family.has_ground else own.max(initial=0.0))


def _spread(f0: float) -> float:
    """Standard deviation of the weight's logarithm for a lobe that looks like one of base reflectance ``f0``."""
    f0 = max(f0, 1e-6)
    # to the nearer kind of bulk: what lies far from both is likelier a part of something
    off = min(abs(np.log(f0 / BULK_F0)), max(float(np.log(METAL_F0 / f0)), 0.0))
    whole = (1.0 - PARTIAL) * _density(off, BULK_SPREAD)
    part = PARTIAL * _density(off, float(np.hypot(BULK_SPREAD, PARTIAL_SPREAD)))
    return PARTIAL_SPREAD * float(np.sqrt(part / (part + whole)))


def _density(off: float, spread: float) -> float:
    """Of a normal distribution, up to a factor."""
    return float(np.exp(-0.5 * (off / spread) ** 2) / spread)
