"""What ``process`` and ``fit`` give back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from photogonio.calib.remarks import LeftOut
    from photogonio.calib.setup import Setup
    from photogonio.capture.diagnosis import Diagnosis
    from photogonio.options import Choice
    from photogonio.reconstruct.brdf.brdf import Brdf
    from photogonio.reconstruct.fit import FitResult
    from photogonio.reconstruct.table.facet_table import FacetTable
    from photogonio.run.circumstances import Circumstances
    from photogonio.run.surroundings import LightAround
    from photogonio.system.provenance import Provenance


@dataclass(frozen=True, slots=True)
class Fault:
    """A check that failed."""

    code: str
    found: str
    cause: str

    def __str__(self) -> str:
        return f"{self.found} ({self.code}); likeliest cause: {self.cause}"


@dataclass(frozen=True, slots=True)
class Result:
    """What ``process`` or ``fit`` found."""

    name: str
    setup: Setup | None  # None: tabulated measurements
    table: FacetTable
    fit: FitResult
    choices: tuple[Choice, ...]
    left_out: tuple[LeftOut, ...]
    diagnoses: tuple[Diagnosis, ...]  # what the user is told, by code
    provenance: Provenance
    seconds: Mapping[str, float] = field(default_factory=dict)  # by stage; not written anywhere
    beside: LightAround | None = (
        None  # what shines on the sample besides the lamp; None: tabulated measurements
    )
    coloured: Brdf | None = None  # where the manifest asks for other colours than the camera's
    known: Circumstances | None = None  # what a fit of photos is told besides their table
    faults: tuple[Fault, ...] = ()  # checks that it fails; none: it may be trusted
    prints: Mapping[str, np.ndarray] = field(
        default_factory=dict
    )  # small pictures (h, w, 3) of photos at hand

    @property
    def warnings(self) -> tuple[str, ...]:
        """The diagnoses in words."""
        return tuple(one.message for one in self.diagnoses)

    @property
    def measured(self) -> Setup:
        """How the photos were taken. Raises TypeError where there were none."""
        if self.setup is None:
            raise TypeError("tabulated measurements have no setup")
        return self.setup

    @property
    def brdf(self) -> Brdf:
        return self.fit.brdf if self.coloured is None else self.coloured
