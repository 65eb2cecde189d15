"""Departures: what may not be as the manifest says, or as the model has it. One file and one line of the registry
each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import ClassVar, Protocol, TypeVar

import numpy as np

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.first_look import FirstLook
from photogonio.calib.setup import ViewSetup
from photogonio.capture.diagnosis import Diagnosis, Entry

Known = TypeVar("Known", FirstLook, State)


class Stage(Enum):
    """When a departure is asked for."""

    LOOK = auto()  # of all photos at first sight
    PLACED = auto()  # with a few photos' corners placed by a rough camera
    CLOSER = auto()  # with all of them placed
    MANIFEST = auto()  # once it is known where the camera stood
    CAMERA = auto()  # once corners have the errors that they show
    PHOTO = auto()  # with what each photo shows of lamp, sample and paper, before anything settles
    LIGHT = auto()  # by what settled, and allowed for by settling again
    LAMP = auto()  # once all has settled, before lamps' strengths are read
    PLACES = auto()  # and where all stands is told
    STRENGTH = auto()  # at the end, of the photos that are kept


class Assumption(Protocol[Known]):
    """One thing that may not be as it is taken to be, by what is ``Known`` when it is asked for."""

    stage: ClassVar[Stage]
    entries: ClassVar[tuple[Entry, ...]]  # what it may tell; thresholds say where they are from

    def evidence(self, known: Known, /) -> Sequence[Diagnosis]:
        """What the photos show of it, in words where a person is to be told; nothing if nothing tells.

        Raises:
            InputError: nothing can be made of such a set.
        """
        ...

    def remedy(self, known: Known, found: Sequence[Diagnosis], /) -> Known | None:
        """What is known once it is allowed for; None if that turns out to be no better, and nothing is to be told.

        Raises:
            InputError: nothing of the set is left, or is to be made of it.
        """
        return known


class LookDeparture(Assumption[FirstLook], Protocol):
    """One that photos show before there is a camera."""


class Departure(Assumption[State], Protocol):
    """One that is seen with the camera."""


@dataclass(frozen=True, slots=True)
class Doubt:
    """Relative errors of lamps' strengths that a departure leaves behind."""

    own: np.ndarray | float  # (n,) of each view's strength
    common: float  # that all share


NO_DOUBT = Doubt(0.0, 0.0)


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

    def doubt(self, state: State, views: Sequence[ViewSetup]) -> Doubt:
        """What is left, allowed for or not, in the lamps' strengths once all has settled."""
        return NO_DOUBT

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
