"""What is to be told at the end of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from photogonio.calib.setup import LeftOut

_NAMED = 4  # photos named in a warning


def listed(names: Sequence[str]) -> str:
    """The first few names."""
    return ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")


@dataclass(slots=True)
class Remarks:
    """Gathered on the way by every stage."""

    left_out: list[LeftOut] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    residuals: dict[str, object] = field(default_factory=dict)  # plain JSON values

    def leave_out(self, name: str, reason: str) -> None:
        self.left_out.append(LeftOut(name, reason))
        self.warnings.append(f"{name}: left out, {reason}")

    def reasons(self) -> str:
        """The first few reasons in one line."""
        return (
            "; ".join(f"{o.name}: {o.reason}" for o in self.left_out[:3])
            or "none has a light that can be found"
        )
