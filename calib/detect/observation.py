"""What is known of one photo while the set is being calibrated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from photogonio.calib.detect.edges import Edges
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.limb import Limb
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Pose
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import LightEntry, PhotoSet, View

Posed = tuple[str, Corners, Pose]  # block's name, corners and pose of one calibration photo

POSE = "pose "  # begins the names of poses' blocks, the photo's name follows
FIXED_POSE = "pose fixed"  # the block that all views of a fixed camera share

Recall = Callable[[], PaperReading]
Keep = Callable[[PaperReading], Recall]  # sets a reading aside; what it returns gives it back


def in_memory(reading: PaperReading) -> Recall:
    return lambda: reading


@dataclass(slots=True)
class Observation:
    """One sample or probe view. Filled in step by step by the stages of calibration, and by nothing else."""

    view: View
    light: str  # id
    corners: Corners | None
    pose: Pose
    pose_block: str  # shared by the views of a fixed camera
    pose_rms: float = float("nan")
    highlights: list[Highlight] = field(default_factory=list)
    limb: Limb | None = None  # of the sample; of a still camera's photos the first holds all
    edges: Edges | None = None  # of a flat sample
    ball_limbs: dict[int, Limb] = field(default_factory=dict)  # of mirror balls, by number
    dark: bool = False  # nothing but noise on the paper
    shading: np.ndarray | None = None  # local values of the latest shading fit
    rejected: np.ndarray = field(default_factory=lambda: np.zeros((0, 2)))  # pixels of corners left out
    keep: Keep = in_memory  # where the reading goes: of hundreds of photos they would fill the memory
    _recall: Recall | None = None

    @property
    def reading(self) -> PaperReading | None:
        """What was read of the paper; each access may bring it in anew."""
        return None if self._recall is None else self._recall()

    @reading.setter
    def reading(self, reading: PaperReading | None) -> None:
        self._recall = None if reading is None else self.keep(reading)

    @property
    def has_paper(self) -> bool:
        """Whether there is a reading."""
        return self._recall is not None

    @property
    def probe(self) -> bool:
        return self.view.photos[0].role == "probe"


def hand_over(observations: Sequence[Observation], kept: Sequence[Observation]) -> None:
    """What all photos of a still camera show together goes from those that are left out to one that is ``kept``."""
    for observation in observations:
        heir = next((k for k in kept if k.pose_block == observation.pose_block and not k.probe), None)
        if observation.limb is not None and heir is not None and all(k is not observation for k in kept):
            heir.limb, observation.limb = observation.limb, None


def light_entry(photoset: PhotoSet, view: View) -> LightEntry | None:
    """The manifest's entry of a view's light; a view that names none has the only light there is."""
    if view.light is None and len(photoset.lights) == 1:
        return photoset.lights[0]
    return next((e for e in photoset.lights if e.id == view.light), None)


def light_id(photoset: PhotoSet, view: View) -> str:
    """The light's id; a view without one has a light of its own, called after the view."""
    entry = light_entry(photoset, view)
    if entry is not None:
        return entry.id
    return view.light or view.name


def channel_names(count: int) -> tuple[str, ...]:
    """Names of a picture's channels in file order."""
    if count < 1:
        raise InputError("photo", "has no channels")
    return {1: ("Y",), 3: ("R", "G", "B")}.get(count, tuple(f"C{k}" for k in range(count)))
