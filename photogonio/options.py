"""What a user may ask of a fit, and what became of it."""

from __future__ import annotations

import os
from dataclasses import dataclass

Auto = int | None  # None: chosen automatically


@dataclass(frozen=True, slots=True)
class Options:
    """Options that ``process`` and ``fit`` share. None: chosen automatically, and the reason is told."""

    order: Auto = None
    level: Auto = None
    symmetry: str = "auto"  # "auto" | "isotropic" | "reciprocal" | "general"
    lobes: Auto = None  # how many
    physics: str = "auto"  # "auto" | "on" | "off": photogonio.reconstruct.fit.FitOptions
    prior: str = "auto"  # "auto" | "none": least squares alone
    robust: bool = True  # single values that contradict their neighbours lose their say
    quantity: str = "brdf"  # what is developed in modes: photogonio.reconstruct.fit.FitOptions
    channels: tuple[str, ...] | None = None  # None: all
    workers: int | None = None  # None: one a core
    executor: str | None = None  # "dask://HOST:PORT": photos are reduced there; None: by workers here

    def threads(self) -> int:
        return self.workers or os.cpu_count() or 1

    def to_dict(self) -> dict[str, object]:
        """What was asked, as command-line options; workers leave no trace in a result."""
        lobes = "none" if self.lobes == 0 else self.lobes
        return {
            "order": self.order,
            "level": self.level,
            "symmetry": self.symmetry,
            "lobes": lobes,
            "physics": None if self.physics == "auto" else self.physics,
            "prior": None if self.prior == "auto" else self.prior,
            "robust": None if self.robust else "off",
            "channels": self.channels,
        }


@dataclass(frozen=True, slots=True)
class Choice:
    """One thing that was chosen, and why."""

    what: str
    value: str
    reason: str
