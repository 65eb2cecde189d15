"""A set while it is being calibrated: each stage gives the next state, and none changes one that is there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from photogonio.calib.adjust.bundle import Values
from photogonio.calib.adjust.camera_model import CameraModel
from photogonio.calib.adjust.lamps import Lamp
from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.observation import Observation, Posed
from photogonio.calib.detect.observe import observe
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.detect.photo_reader import Progress, Reader
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.calib.setup import PrintTone
from photogonio.calib.shading.correction import NO_CORRECTION, NO_FALLOFF, Corrections, PhotometricCorrection
from photogonio.calib.shading.fit import ShadingFit
from photogonio.calib.shading.model import ShadingScene
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.photoset import PhotoSet


@dataclass(frozen=True, slots=True)
class Settled:
    """Where everything came to rest."""

    camera: Camera
    model: CameraModel
    values: Values
    covariance: dict[str, np.ndarray]
    lamps: dict[str, Lamp]
    misses: dict[str, np.ndarray]  # (k, 2) highlight residuals by light, pixels
    shading: dict[str, ShadingFit]  # by view
    scene: ShadingScene | None
    corner_rms: float  # of the corners' residuals, in their standard errors
    highlight_scale: float  # what the highlights' stated errors had to be multiplied with


@dataclass(frozen=True, slots=True)
class State:
    """What is known of a set so far. ``remarks`` is the log of the whole calibration, which states share."""

    photoset: PhotoSet  # with the sample where it is seen
    reader: Reader
    camera: Camera  # by the corners alone
    model: CameraModel
    boards: tuple[Posed, ...]  # calibration photos
    observations: tuple[Observation, ...]  # sample and probe views
    remarks: Remarks
    tell: Progress
    corrections: Corrections = field(default_factory=dict)  # of the photos, by view
    narrow: float = 0.0  # power of the cosine with which the lamps are known to shine, about
    falloff: tuple[float, float] = NO_FALLOFF  # terms with which the lens is known to darken its pictures
    settled_or_none: Settled | None = None
    highlights: Mapping[str, tuple[Highlight, ...]] | None = None  # by view, as seen before anything settled
    found: Mapping[str, Diagnosis] = field(default_factory=dict)  # by code: the latest of lamps and lens
    rig: RigPrior = NOTHING  # what other sets of one rig lead to expect
    tone: PrintTone | None = (
        None  # what print told of the tone curve by which photos are read, and of lamps with it
    )

    @property
    def settled(self) -> Settled:
        """Raises ValueError before anything settled."""
        if self.settled_or_none is None:
            raise ValueError("nothing has settled yet")
        return self.settled_or_none

    def papers(self) -> Iterator[tuple[str, PaperReading]]:
        """Views that show lit paper, with what was read of it, one at a time: all would fill the memory."""
        for one in self.observations:
            if not one.dark and (reading := one.reading) is not None:
                yield one.view.name, reading

    def copied(self) -> list[Observation]:
        """The observations, to be filled in."""
        return [replace(one) for one in self.observations]

    def started_over(self) -> list[Observation]:
        """The same as they were before lamps were sought: shading that did not know all of the light may have taken
        some highlights for something else."""
        if self.highlights is None:
            return self.copied()
        return [
            replace(one, highlights=list(self.highlights[one.view.name]), shading=None)
            for one in self.observations
        ]

    def correction(self, view: str) -> PhotometricCorrection:
        """What lies between a view's photo and the light."""
        return self.corrections.get(view, NO_CORRECTION)

    def with_paper(self, change: Callable[[Observation, PaperReading], PaperReading | None]) -> State:
        """The same with the paper of all views changed."""
        observations = self.copied()
        for one in observations:
            if (reading := one.reading) is not None:
                changed = change(one, reading)
                if changed is not reading:
                    one.reading = changed
        return replace(self, observations=tuple(observations))

    def keeping(self, observations: Iterable[Observation]) -> State:
        """The same with these observations."""
        return replace(self, observations=tuple(observations))


def observed(state: State) -> State:
    """The state with what each photo shows of lamp, sample and paper."""
    observations = state.copied()
    photoset = state.photoset
    observe(photoset, state.reader, state.camera, observations, photoset.mirror_balls, state.tell)
    return state.keeping(observations)
