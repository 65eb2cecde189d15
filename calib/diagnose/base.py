"""Departures: what may not be as the manifest says, or as the model has it. One file and one line of the "
"registry each."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum, auto
from typing import ClassVar, Protocol

from photogonio.calib.adjust.state import State
from photogonio.capture.diagnosis import Diagnosis, Entry


class Stage(Enum):
    """When a departure is asked for."""

    MANIFEST = auto()  # once it is known where the camera stood
    CAMERA = auto()  # once corners have the errors that they show
    PHOTO = auto()  # with what each photo shows of lamp, sample and paper, before anything settles
    LIGHT = auto()  # by what settled, and allowed for by settling again
    STRENGTH = auto()  # at the end


class Departure(Protocol):
    """One thing that may not be as it is taken to be."""

    stage: ClassVar[Stage]
    entries: ClassVar[tuple[Entry, ...]]  # what it may tell; thresholds say where they are from

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        """What the photos show of it, in words where a person is to be told; nothing if nothing tells.

        Raises:
            InputError: nothing can be made of such a set.
        """
        ...

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State | None:
        """The state in which it is allowed for; None if that turns out to be no better, and nothing is to be told.

        Raises:
            InputError: nothing of the set is left.
        """
        return state


class LightDeparture(Departure, Protocol):
    """One of lamps and lens: the surest that is told is allowed for first, and the others are asked again."""

    stage: ClassVar[Stage] = Stage.LIGHT
    code: ClassVar[str]  # of its one diagnosis
    after: ClassVar[tuple[str, ...]] = ()  # codes that are allowed for before it, if they are told
    anew: ClassVar[
        tuple[str, ...]
    ] = ()  # codes that are forgotten with it: what it does may have passed for them
    certain: ClassVar[bool] = True  # else it is kept only where the paper then fits closer

    def evidence(self, state: State) -> Sequence[Diagnosis]: ...

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        """The state to be settled again."""
        ...

    def as_settled(self, state: State, found: Diagnosis) -> Diagnosis:
        """The same as it is once all has settled."""
        return found

    def numbers(self, found: Diagnosis) -> dict[str, object]:
        """For setup.json's residuals."""
        return {}

    def told_as(self, found: Diagnosis) -> str:
        """The code under which it is told."""
        return self.code

    def message(self, found: Diagnosis, *, allowed: bool) -> str:
        """In words, if it is to be told."""
        return ""
