"""What is not as the manifest says, or as the model has it: one record for every such thing, by code."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What one departure amounts to in a set of photos, or in a table."""

    code: str  # key in setup.json, heading in docs/diagnoses.md
    message: str = ""  # in words, one line
    amount: float = 1.0  # in a unit of its own; a count, or a mere fact, has error 0
    error: float = 0.0  # standard error
    least: float = 0.0  # the amount that is told at all,
    sigmas: float = 0.0  # and the standard errors at which it is
    views: tuple[str, ...] = ()  # photos concerned, each by its first file; none: all
    allowed: bool = False  # whether what follows from it was allowed for, or taken out
    detail: Mapping[str, object] = field(default_factory=dict)  # plain JSON values
    grounds: Any = field(default=None, compare=False, repr=False)  # what a remedy takes; not written

    @property
    def told(self) -> bool:
        """Whether it is so much, and so surely, that it counts."""
        return self.amount > max(self.least, self.sigmas * self.error)

    @property
    def sureness(self) -> float:
        """Standard errors by which it differs from nothing; infinite for what is counted."""
        return self.amount / self.error if self.error > 0 else float("inf")

    def to_dict(self) -> dict[str, object]:
        """Plain JSON values."""
        told = {name: getattr(self, name) for name in self.__slots__ if name != "grounds"}
        return told | {"views": list(self.views), "detail": dict(self.detail)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Diagnosis:
        """Inverse of :meth:`to_dict`; keys that it does not know are left alone.

        Raises:
            KeyError, TypeError, ValueError: the values are of other kinds.
        """
        numbers = {name: float(data[name]) for name in ("amount", "error", "least", "sigmas")}
        views = tuple(str(name) for name in data["views"])
        code, message = str(data["code"]), str(data["message"])
        return cls(
            code, message, **numbers, views=views, allowed=bool(data["allowed"]), detail=dict(data["detail"])
        )


@dataclass(frozen=True, slots=True)
class Entry:
    """What is said of a code in docs/diagnoses.md."""

    code: str
    means: str  # one or two sentences
    advice: str  # what to do
    least: float = 0.0  # as in Diagnosis, where one threshold holds for all sets
    sigmas: float = 0.0
    source: str = ""  # where these are from


def by_code(diagnoses: tuple[Diagnosis, ...]) -> dict[str, list[dict[str, object]]]:
    """Plain JSON values, in the order of the codes' first mention."""
    found: dict[str, list[dict[str, object]]] = {}
    for one in diagnoses:
        found.setdefault(one.code, []).append(one.to_dict())
    return found


def from_codes(data: Mapping[str, list[Mapping[str, Any]]]) -> tuple[Diagnosis, ...]:
    """Inverse of :func:`by_code`, but for the order between codes."""
    return tuple(Diagnosis.from_dict({**one, "code": code}) for code, many in data.items() for one in many)
