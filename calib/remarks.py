"""What is to be told at the end of a calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from photogonio.capture.diagnosis import Diagnosis

_NAMED = 4  # photos named in a warning


def listed(names: Sequence[str]) -> str:
    """The first few names."""
    return ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")


@dataclass(frozen=True, slots=True)
class LeftOut:
    name: str  # photo
    reason: str


@dataclass(slots=True)
class Remarks:
    """Gathered on the way by every stage."""

    left_out: list[LeftOut] = field(default_factory=list)
    diagnoses: list[Diagnosis] = field(default_factory=list)
    residuals: dict[str, object] = field(default_factory=dict)  # plain JSON values

    def tell(self, code: str, message: str, *, views: Sequence[str] = (), **told: Any) -> None:
        """One more diagnosis. ``told``: its amount, error, least, sigmas and whether it was allowed for; all else is
        detail."""
        known = {
            name: told.pop(name) for name in ("amount", "error", "least", "sigmas", "allowed") if name in told
        }
        self.diagnoses.append(Diagnosis(code, message, views=tuple(views), detail=told, **known))

    def leave_out(self, name: str, reason: str, code: str) -> None:
        """A photo that is not used."""
        self.left_out.append(LeftOut(name, reason))
        self.tell(code, f"{name}: left out, {reason}", views=(name,))

    @property
    def warnings(self) -> tuple[str, ...]:
        """All messages in order."""
        return tuple(one.message for one in self.diagnoses)

    def codes(self) -> list[str]:
        """Codes of what is told, in order."""
        return [one.code for one in self.diagnoses]

    def reasons(self) -> str:
        """The first few reasons in one line."""
        return (
            "; ".join(f"{o.name}: {o.reason}" for o in self.left_out[:3])
            or "none has a light that can be found"
        )
