"""Two BRDFs against each other: the field's measures, what the eye would see, and the scatter plot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.compare import metrics
from photogonio.compare.appearance import Appearance, appearance
from photogonio.compare.colours import in_common_colours
from photogonio.compare.known import Known
from photogonio.compare.metrics import Directions
from photogonio.compare.significance import Side, Significance, pairs_below, significance
from photogonio.report.misfit import correlation

_ALBEDO_ANGLES = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0])
_ROUNDING = 1e-9  # radians: an angle written as 70 degrees is not below 70


@dataclass(frozen=True, slots=True)
class Comparison:
    """How far ``a`` is from the reference ``b``; every measure one number a channel."""

    names: tuple[str, str]
    channels: tuple[str, ...]
    mask: float  # radians; pairs with either angle at or beyond it do not count
    scale: np.ndarray  # (c,) factor that a was multiplied by first; ones unless asked for
    measures: dict[str, np.ndarray]  # name -> (c,)
    at: Directions
    a: np.ndarray  # (n, c) 1/sr
    b: np.ndarray  # (n, c) 1/sr
    appearance: Appearance | None  # None where a or b is known at given pairs only
    significance: Significance | None = None  # None where neither says how sure it is

    def to_dict(self) -> dict[str, object]:
        numbers: dict[str, object] = {
            "a": self.names[0],
            "b": self.names[1],
            "mask_degrees": float(np.degrees(self.mask)),
            "pairs": len(self.a),
            "channels": self.channels,
            "scale": self.scale,
            **self.measures,
        }
        numbers["difference"] = None if self.significance is None else self.significance.to_dict()
        return numbers | ({"appearance": self.appearance.to_dict()} if self.appearance else {})


def compare(a: Known, b: Known, *, mask: float = np.radians(80.0), scale: bool = False) -> Comparison:
    """Compare ``a`` with the reference ``b`` over all pairs with both angles below ``mask`` (radians).

    Where either is known at given pairs only, those pairs count; else a quadrature over the hemispheres. With
    ``scale`` one factor a channel is found for ``a`` first, the one of least relative L2.

    Raises:
        InputError: the channels differ, the pairs differ, or none is below the mask.
    """
    a, b = in_common_colours(a, b)
    channels, take_a, take_b = _match(a, b)
    at, value_a, value_b = _values((a, take_a), (b, take_b), mask)
    factor = _factor(value_a, value_b, at) if scale else np.ones(len(channels))
    value_a = value_a * factor
    measures = pointwise(value_a, value_b, at)
    seen = None
    if a.evaluate is not None and b.evaluate is not None:
        judged, reference = _everywhere(a.evaluate, take_a, factor), _everywhere(b.evaluate, take_b, 1.0)
        measures |= _integrals(judged, reference, at, mask)
        seen = appearance(judged, reference, channels)
    pairs, few_a, few_b = at, value_a / factor, value_b
    if a.at is None and b.at is None:
        pairs = pairs_below(mask, isotropic=a.isotropic and b.isotropic)
        few_a, few_b = a.values(pairs)[:, take_a], b.values(pairs)[:, take_b]
    sides = Side.of(a, take_a, few_a), Side.of(b, take_b, few_b)
    sure = significance(*sides, pairs, channels, scale=scale)
    return Comparison((a.name, b.name), channels, mask, factor, measures, at, value_a, value_b, seen, sure)


def _everywhere(known: metrics.Evaluate, channels: list[int], factor: np.ndarray | float) -> metrics.Evaluate:
    """f of the channels compared; what a table marks as not measured counts as 0."""

    def evaluate(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        return np.nan_to_num(known(incident, exit)[:, channels] * factor)

    return evaluate


def pointwise(a: np.ndarray, b: np.ndarray, at: Directions) -> dict[str, np.ndarray]:
    """All measures that values at pairs of directions give, by name."""
    return {
        "relative_l2": metrics.relative_l2(a, b, at),
        "ngan_l2": metrics.ngan_l2(a, b, at),
        "standard_log": metrics.standard_log(a, b, at),
        "cube_root": metrics.cube_root(a, b, at),
        "maximum": metrics.maximum(a, b),
        "negative_fraction": metrics.negative_fraction(a, at),
        "correlation": np.array([correlation(b[:, k], a[:, k]) for k in range(a.shape[1])]),
    }


def _integrals(judged, reference, at: Directions, mask: float) -> dict[str, np.ndarray]:
    angles = _ALBEDO_ANGLES[_ALBEDO_ANGLES < mask]
    albedo_a = metrics.directional_albedo(judged, angles)
    albedo_b = metrics.directional_albedo(reference, angles)
    return {
        "albedo_error": np.abs(albedo_a - albedo_b).max(0),
        "reciprocity_residual": metrics.reciprocity_residual(judged, at),
    }


def _match(a: Known, b: Known) -> tuple[tuple[str, ...], list[int], list[int]]:
    """Channels by name where the names agree, else in order; one channel stands against any number."""
    if set(a.channels) == set(b.channels):
        return b.channels, [a.channels.index(name) for name in b.channels], list(range(len(b.channels)))
    common = [name for name in b.channels if name in a.channels]
    if common:
        return tuple(common), [a.channels.index(n) for n in common], [b.channels.index(n) for n in common]
    if len(a.channels) == len(b.channels):
        return b.channels, list(range(len(a.channels))), list(range(len(b.channels)))
    if len(b.channels) == 1 or len(a.channels) == 1:
        many = a if len(b.channels) == 1 else b
        of_a, of_b = (list(range(len(k.channels))) if k is many else [0] * len(many.channels) for k in (a, b))
        return many.channels, of_a, of_b
    raise InputError(
        a.name, f"channels {', '.join(a.channels)} are not those of {b.name}: {', '.join(b.channels)}"
    )


def _values(
    one: tuple[Known, list[int]], other: tuple[Known, list[int]], mask: float
) -> tuple[Directions, np.ndarray, np.ndarray]:
    """The pairs that count, and both at them, each in its channels that are named."""
    (a, take_a), (b, take_b) = one, other
    at = b.at or a.at or metrics.quadrature(mask, isotropic=a.isotropic and b.isotropic)
    if a.at is not None and b.at is not None and not _same(a.at, b.at):
        raise InputError(
            a.name, f"is known at other directions than {b.name}; one of the two must be known at all"
        )
    value_a, value_b = a.values(at)[:, take_a], b.values(at)[:, take_b]
    edge = np.cos(mask - _ROUNDING)
    keep = (at.cos_i > edge) & (at.cos_r > edge) & np.isfinite(value_a + value_b).all(1)
    if not keep.any():
        raise InputError(b.name, f"has no pair of directions below {np.degrees(mask):g} degrees")
    return Directions(at.incident[keep], at.exit[keep], at.weight[keep]), value_a[keep], value_b[keep]


def _same(a: Directions, b: Directions) -> bool:
    return a.incident.shape == b.incident.shape and all(
        np.allclose(x, y, atol=1e-6) for x, y in ((a.incident, b.incident), (a.exit, b.exit))
    )


def _factor(a: np.ndarray, b: np.ndarray, at: Directions) -> np.ndarray:
    weight = (at.weight * at.cos_i * at.cos_r)[:, None]
    return (weight * a * b).sum(0) / (weight * a**2).sum(0)
