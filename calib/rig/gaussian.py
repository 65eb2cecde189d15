"""What some photos say of a few values, and what is expected of values before any photo tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_STRONG = 1e-9  # of all that is known of a direction: what is below is nothing


@dataclass(frozen=True, slots=True)
class RigTold:
    """What one set's photos alone say of values: exp(-0.5 (x - value)' information (x - value))."""

    name: str  # of the values, as "camera 0 1 2 3"
    value: np.ndarray  # (d,)
    information: np.ndarray  # (d, d), no larger than what the photos tell; may be singular
    before: np.ndarray  # (d,) what is expected where no photo tells,
    usual: np.ndarray  # (d, d) and the information of that


@dataclass(frozen=True, slots=True)
class RigExpected:
    """What other sets of the rig lead one to expect of values."""

    name: str
    value: np.ndarray  # (d,)
    covariance: np.ndarray  # (d, d), with what changes from set to set
    sets: int  # that tell it

    @property
    def root(self) -> np.ndarray:
        """(d, d) whose product with what values are off is in standard errors."""
        return np.linalg.inv(np.linalg.cholesky(self.covariance))


@dataclass(frozen=True, slots=True)
class RigPrior:
    """All that other sets lead to expect of one set's rig."""

    expected: tuple[RigExpected, ...] = ()
    differs: tuple[str, ...] = ()  # names of values in which the set contradicts the others

    def get(self, name: str) -> RigExpected | None:
        """The values of a name; None where nothing is expected of them."""
        return next((one for one in self.expected if one.name == name), None)

    def starting(self, word: str) -> RigExpected | None:
        """Likewise of those whose name begins with a word."""
        return next((one for one in self.expected if one.name.split(" ")[0] == word), None)


NOTHING = RigPrior()


def told_beside(
    name: str, value: np.ndarray, covariance: np.ndarray, mean: np.ndarray, prior: np.ndarray
) -> RigTold:
    """What photos alone say, of an estimate (d,) with its covariance (d, d) that an expectation went into:
    ``mean`` (d,) with information ``prior`` (d, d)."""
    whole = np.linalg.inv(covariance)
    scale = 1.0 / np.sqrt(np.diag(whole))
    size, axes = np.linalg.eigh(scale[:, None] * (whole - prior) * scale)
    size = np.where(size > _STRONG, size, 0.0)
    back = axes / scale[:, None]
    information = (back * size) @ back.T
    # information @ alone = whole @ value - prior @ mean, in the directions that photos tell
    forward = axes * scale[:, None]
    inverse = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)
    off = whole @ (value - mean)
    return RigTold(name, mean + (forward * inverse) @ (forward.T @ off), information, mean, prior)
