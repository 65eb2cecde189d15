"""How often the symmetry of a surface is chosen wrongly, on simulated photo sets of planes.

Isotropic surfaces of every kind that the renderer has, and GGX surfaces (bare metal, and a coat over a ground) whose
roughnesses along two axes differ by 1.5 and more, at any azimuth; planes seen and lit from all sides. Every view has
errors of its own (scale, direction of the lamp, noise, spoiled pixels) and all share a pattern on the plane and a
normal that leans. Isotropic choices are counted apart where the report says that the data could not tell::

    python -m benchmarks.symmetry_choice [--sets N] [--first K] [--kind KIND] [--quick] [--csv FILE]

``--quick`` takes two sets of each kind. Of measured rows: :mod:`benchmarks.row_symmetry`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.estimate.pilot import clean
from photogonio.reconstruct.symmetry.verdict import Verdict, judge
from photogonio.reconstruct.table.cells import cells_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]
SETS = 200
QUICK = 2
THETA_MAX = np.radians(80.0)
ISOTROPIC = (
    "ggx-conductor",
    "plastic",
    "satin-paint",
    "oren-nayar",
    "lambert",
    "blinn-phong",
    "torrance-sparrow",
    "minnaert",
)


@dataclass(frozen=True, slots=True)
class Coated:
    """A coat of two roughnesses over a diffuse ground: what shines is a few per cent."""

    coat: Surface
    albedo: float

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        return self.coat(incident, exit) + self.albedo / np.pi


@dataclass(frozen=True, slots=True)
class Turned:
    """A surface turned about its normal by ``azimuth``, radians."""

    surface: Surface
    azimuth: float

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        cos, sin = np.cos(self.azimuth), np.sin(self.azimuth)
        back = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return self.surface(incident @ back, exit @ back)


def isotropic(rng: np.random.Generator) -> tuple[str, Surface]:
    """A surface with one channel, and its name."""
    name = ISOTROPIC[rng.integers(len(ISOTROPIC))]
    albedo, roughness = (float(rng.uniform(0.1, 0.8)),), float(rng.uniform(0.12, 0.5))
    own = {
        "ggx-conductor": {"f0": (float(rng.uniform(0.4, 0.95)),), "roughness": roughness},
        "plastic": {"albedo": albedo, "roughness": roughness},
        "blinn-phong": {"albedo": albedo, "power": float(rng.uniform(8.0, 60.0))},
        "torrance-sparrow": {"albedo": albedo, "width": roughness},
        "minnaert": {"albedo": albedo, "k": float(rng.uniform(0.7, 1.5))},
    }
    parameters = own.get(name, {"albedo": albedo})
    return f"{name} {parameters}", make_brdf(name, parameters)


def anisotropic(rng: np.random.Generator) -> tuple[str, Surface]:
    """GGX of unequal roughness, bare or over a ground, and its name."""
    aspect, mean = float(1.5 + rng.exponential(0.8)), float(rng.uniform(0.15, 0.4))
    rough, smooth = min(mean * np.sqrt(aspect), 0.8), mean / np.sqrt(aspect)
    bare, azimuth = rng.uniform() < 0.5, float(rng.uniform(0.0, np.pi))
    f0 = float(rng.uniform(0.4, 0.95) if bare else rng.uniform(0.04, 0.08))
    surface = make_brdf("anisotropic-ggx", {"f0": (f0,), "roughness_x": rough, "roughness_y": smooth})
    albedo = 0.0 if bare else float(rng.uniform(0.1, 0.6))
    name = f"{rough:.2f} by {smooth:.2f}, f0 {f0:.2f} over {albedo:.2f}, {np.degrees(azimuth):.0f} degrees"
    return name, Turned(Coated(surface, albedo), azimuth)


KINDS = (isotropic, anisotropic)


def plan(rng: np.random.Generator) -> Plan:
    """A set of a plane that is seen and lit from all sides."""
    return Plan(
        shape="plane",
        camera="moving",
        isotropic=False,
        views=int(rng.integers(16, 41)),
        pixels=600,
        level=3,
        camera_distance=float(rng.uniform(10.0, 25.0)),
        view_error=float(rng.uniform(0.005, 0.01)),
        lamp_error=0.15,
        tilt=float(rng.uniform(0.0, 0.3)),
        texture=float(rng.uniform(0.0, 0.03)),
    )


def verdict_on(surface: Surface, how: Plan, seed: int) -> Verdict:
    """What is chosen for a simulated set."""
    cells = cells_of(simulate(surface, how, seed=seed))
    cells = cells.take((cells.theta_i <= THETA_MAX) & (cells.theta_r <= THETA_MAX))
    errors = np.full(len(cells.groups), 0.005)
    return judge(cells, errors, clean(cells, errors, lobes=None, absolute=True, rounds=1), absolute=True)


def trials(kind, sets: range) -> Iterator[tuple[str, Plan, Verdict]]:
    for seed in sets:
        rng = np.random.default_rng([seed, kind is anisotropic])
        name, surface = kind(rng)
        how = plan(rng)
        yield name, how, verdict_on(surface, how, seed)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=SETS)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", choices=[kind.__name__ for kind in KINDS])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--csv")
    asked = parser.parse_args(arguments)
    sets = range(asked.first, asked.first + (QUICK if asked.quick else asked.sets))
    rows = ["kind,surface,views,chosen,log_odds,could_show,reason"]
    for kind in KINDS if asked.kind is None else [k for k in KINDS if k.__name__ == asked.kind]:
        wrong = untold = 0
        for name, how, verdict in trials(kind, sets):
            turning = verdict.symmetry != "isotropic"
            wrong += turning == (kind is isotropic)
            untold += verdict.reason.startswith("assumed")
            odds = ",".join(
                "" if one is None else f"{one:.2f}" for one in (verdict.log_odds, verdict.could_show)
            )
            rows.append(f'{kind.__name__},"{name}",{how.views},{verdict.symmetry},{odds},"{verdict.reason}"')
            if turning == (kind is isotropic):
                print(f"wrong: {rows[-1]}", flush=True)
        share = wrong / len(sets)
        print(
            f"{kind.__name__}: {wrong} of {len(sets)} wrong ({share:.1%}); {untold} could not tell",
            flush=True,
        )
    if asked.csv:
        with open(asked.csv, "w", encoding="utf-8") as file:
            file.write("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
