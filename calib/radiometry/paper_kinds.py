"""What plain paper reflects, by kind: a scale for those who have no patch, as unsure as papers differ.

Office paper: 0.80 +- 0.05. The others by the papers of ISO 12647-2:2004, whose lightness L* is given on black and on
white backing: gloss coated 93 and 95 (Y 0.83 and 0.88), matte coated 92 and 94 (0.81 and 0.85), white uncoated 92 and
95 (0.81 and 0.88), yellowish uncoated 88 and 90 (0.72 and 0.76). Inkjet and photo papers are as white as the whitest
of these; recycled ones are like the last or greyer. Optical brighteners and tints set one channel apart from the
others by less than the errors.
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
