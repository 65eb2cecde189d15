"""Two sessions of one sample by ``add`` against either alone: is the sum no worse than the better, and said rightly?

    python -m benchmarks.sessions [--pairs 8] [--seed 1] [--quick]

A ball of a drawn surface is photographed twice, 160 x 120 pixels, with noise: three to nine lamps each, whose strengths
are known to 0.3 %, in frames, units and under angles of each session's own. Camera, ball and lamps are given. Each
session's scale is off by an error that is drawn from what it states, 0.3 to 4 %, with 0.2 % that a white patch is not
known better than; of every fourth pair the second has a scale of its own. Sessions alone and both together are fitted
with everything automatic, and judged by their files within 70 degrees where photos of either looked. "joined over
better" below 1 says that the sum gains; "over stated" is the error over the standard error that the file has.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.intervals import LIMIT, drawn, judged, of_file
from photogonio.compare.known import Known
from photogonio.face.known import KnownBrdf
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.validity import seen_at
from photogonio.refit import fit_again
from photogonio.result import Result
from photogonio.run.circumstances import SCALE_ERROR, Circumstances
from photogonio.run.session_scales import Session
from photogonio.run.sessions import joined
from photogonio.synthetic.brdf.library import angle_grid, on_grid
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance
from tests.drawn.tiny_set import FOCAL, HEIGHT, WIDTH, toward

LAMP_ERROR = 0.003
QUICK = Options(order=0, lobes=0)
BRIGHTEST = 0.7  # of full scale


@dataclass(frozen=True, slots=True)
class Plan:
    """One session: lamps (n, 2), degrees about the camera's direction; the ball, where it stands, and its scale."""

    lamps: np.ndarray
    radius: float
    distance: float
    turn: np.ndarray  # (3, 3) world from the camera's upright frame
    shift: np.ndarray
    scale_error: float  # relative; infinite: not known

    @classmethod
    def of(cls, rng: np.random.Generator, lamps: int, scale_error: float) -> Plan:
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        unit = 10.0 ** rng.uniform(-2.0, 1.0)
        return cls(
            np.column_stack([rng.uniform(5.0, 110.0, lamps), rng.uniform(0.0, 360.0, lamps)]),
            25.0 * unit,
            rng.uniform(190.0, 230.0) * unit,
            turn * np.sign(np.linalg.det(turn)),
            rng.normal(0.0, 30.0, 3) * unit,
            scale_error,
        )


def photographed(folder: Path, truth: Reflectance, plan: Plan, rng: np.random.Generator) -> None:
    """The session's set."""
    import cv2

    camera = np.diag([1.0, -1.0, -1.0]) @ plan.turn.T
    place = np.array([0.0, 0.0, plan.distance]) - camera @ plan.shift
    middle = f"{(WIDTH - 1) / 2}], [0, {FOCAL}, {(HEIGHT - 1) / 2}], [0, 0, 1]"
    lines = [
        f'format = 1\nname = "{folder.name}"\n[sample]\nshape = "sphere"\ncenter = {plan.shift.tolist()}\n'
        f"radius = {plan.radius}\n[camera]\nmatrix = [[{FOCAL}, 0, {middle}]\nrotation = {camera.tolist()}\n"
        f"translation = {place.tolist()}\n"
    ]
    (folder / "sample").mkdir(parents=True)
    pictures = [_seen(truth, plan, toward(*lamp)) for lamp in plan.lamps]
    gain = BRIGHTEST / max(np.quantile(one, 0.999) for one in pictures)
    for k, (lamp, picture) in enumerate(zip(plan.lamps, pictures, strict=True)):
        light = gain * picture * rng.normal(1.0, LAMP_ERROR)
        light = light + rng.normal(0.0, 1.0, light.shape) * np.sqrt(light / 2e4 + 1e-4**2)
        pixels = np.clip(np.round(light * 65535), 0, 65535).astype(np.uint16)
        cv2.imwrite(str(folder / f"sample/s{k}.png"), pixels[..., ::-1])
        lines.append(
            f'[[light]]\nid = "L{k}"\nkind = "directional"\ndirection = {(plan.turn @ toward(*lamp)).tolist()}\n'
            f'intensity = {gain}\n[[photo]]\nfile = "sample/s{k}.png"\nrole = "sample"\nlight = "L{k}"\n'
        )
    (folder / "photoset.toml").write_text("\n".join(lines))


def _seen(truth: Reflectance, plan: Plan, lamp: np.ndarray) -> np.ndarray:
    """Radiance (h, w, c) of the ball under a lamp that gives irradiance 1, camera above it."""
    x, y = np.meshgrid(np.arange(WIDTH) - (WIDTH - 1) / 2, np.arange(HEIGHT) - (HEIGHT - 1) / 2)
    ray = np.stack([x / FOCAL, -y / FOCAL, -np.ones_like(x)], -1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    eye = np.array([0.0, 0.0, plan.distance])
    along = ray @ eye
    root = along**2 - (eye @ eye - plan.radius**2)
    normal = (eye + (-along - np.sqrt(np.maximum(root, 0.0)))[..., None] * ray) / plan.radius
    lit, back = normal @ lamp, -np.sum(normal * ray, -1)
    seen = (root > 0.0) & (lit > 0.0) & (back > 0.0)
    value = np.zeros((HEIGHT, WIDTH, 3))
    one, two = lamp - lit[..., None] * normal, -ray - back[..., None] * normal
    apart = np.sum(one * two, -1) / np.maximum(
        np.linalg.norm(one, axis=-1) * np.linalg.norm(two, axis=-1), 1e-12
    )
    angles = np.stack([np.arccos(np.clip(c, -1.0, 1.0)) for c in (lit, back, apart)], -1)[seen]
    value[seen] = on_grid(truth, angles) * lit[seen, None]
    return value


def session(folder: Path, plan: Plan, rng: np.random.Generator) -> Session:
    """As `process` leaves it, on a scale that is off by a drawn error."""
    found = process(folder, options=QUICK)
    assert found.known is not None and found.setup is not None
    views = tuple(replace(v, strength_error=LAMP_ERROR * v.strength) for v in found.known.setup.views)
    setup, table = replace(found.known.setup, views=views), found.table
    off = np.exp(rng.normal(0.0, SCALE_ERROR)) * np.exp(rng.normal(0.0, min(plan.scale_error, 1.0)))
    if np.isfinite(plan.scale_error):
        setup = replace(setup, scale="absolute", scale_error=plan.scale_error)
    setup = replace(setup, views=tuple(replace(v, strength=v.strength / off) for v in views))
    table = replace(
        table, value=table.value * off, value2=table.value2 * off**2, variance=table.variance * off**2
    )
    return Session(str(folder), folder.name, table, replace(found.known, setup=setup))


def fitted(known: Circumstances, table) -> Result:
    return fit_again(known, table, Options(), Provenance("benchmark", {}), Reporter(quiet=True))


def pair(seed: int, made: Path) -> tuple[float, float, float]:
    """Draws, fits and judges one: errors of the surer session alone and of both, and that stated of both."""
    kind, truth, _ = drawn(seed)
    rng = np.random.default_rng([seed, 7])
    errors = 10.0 ** rng.uniform(np.log10(0.003), np.log10(0.04), 2)
    if seed % 4 == 3:
        errors[1] = np.inf
    plans = [Plan.of(rng, int(rng.integers(3, 10)), float(error)) for error in errors]
    sessions = []
    for name, plan in zip("ab", plans, strict=True):
        folder = made / f"{seed}" / name
        photographed(folder, truth, plan, rng)
        sessions.append(session(folder, plan, rng))
    table, known = joined(sessions)
    results = [fitted(one.known, one.table) for one in sessions] + [fitted(known, table)]
    angles = angle_grid()
    angles = angles[(angles[:, :2] < LIMIT).all(1)]
    angles = angles[seen_at(results[-1].fit.cells, Cells.of_angles(*angles.T))]
    true = on_grid(truth, angles)
    albedo = KnownBrdf(Known(kind, results[-1].brdf.channels, isotropic=True, evaluate=truth)).albedo().value
    told = [judged(kind, of_file(one.brdf), angles, true, albedo, np.nan, np.nan) for one in results]
    if not np.isfinite(errors[1]):
        told[1] = replace(told[1], error=np.inf)
    a, b, both = (100 * one.error for one in told)
    print(
        f"{seed:4} {kind:16s} scales +- {100 * errors[0]:.1f}, {100 * errors[1]:.1f} %  photos "
        f"{len(plans[0].lamps)}, {len(plans[1].lamps)}  error {a:5.2f} {b:5.2f} joined {both:5.2f} %, stated "
        f"{100 * told[2].stated:.2f}, over stated {told[2].error / told[2].stated:.2f}; over better "
        f"{both / min(a, b):.2f}; intervals hold {100 * told[0].from_file:.0f} {100 * told[1].from_file:.0f} joined "
        f"{100 * told[2].from_file:.0f} %, albedo {100 * told[2].albedo:.0f} %",
        flush=True,
    )
    surer = a if told[0].stated <= told[1].stated or not np.isfinite(errors[1]) else b
    return surer, both, 100 * told[2].stated


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1, help="of the first")
    parser.add_argument("--quick", action="store_true", help="one pair: shows that it runs")
    asked = parser.parse_args(arguments)
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(asked.seed, asked.seed + (1 if asked.quick else asked.pairs)):
            found.append(pair(seed, Path(folder)))
    surer, both, stated = np.array(found).T
    print(
        f"{len(found)} pairs: rms error {_rms(surer):.2f} % of the surer session alone, {_rms(both):.2f} % joined; of "
        f"error over stated {_rms(both / stated):.2f}"
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


if __name__ == "__main__":
    main()
