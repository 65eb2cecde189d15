"""What plain paper reflects, by kind: a scale for those who have no patch, as unsure as papers differ.

Estimates, no paper was measured for them: white papers have a lightness L* of 92 to 95 (Y 0.81 to 0.88), the less the
darker what lies under the sheet; recycled ones are yellowish or grey. Optical brighteners and tints set one channel
apart from the others by less than the errors.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PaperKind:
    """Reflectance of a sheet on a desk, the same in all channels."""

    name: str
    reflectance: float
    error: float  # standard error

    @property
    def relative(self) -> float:
        return self.error / self.reflectance


_KINDS = (
    PaperKind("office", 0.80, 0.05),
    PaperKind("matte-inkjet", 0.85, 0.04),
    PaperKind("photo", 0.86, 0.04),
    PaperKind("recycled", 0.70, 0.07),
)
KINDS = {kind.name: kind for kind in _KINDS}
