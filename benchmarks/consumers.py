"""What exported files lose in the programs that read them: twelve materials, matte to sharp, metals, coats, brushed.

Each file is asked by its consumer (Mitsuba's ``measured``, Radiance's own library; MERL's nearest cell is our reader)
at pairs of directions; printed are the rms below 60 and 80 degrees by projected solid angle, in per cent, the
directional albedo over the source's up to 88 degrees where it is farthest from 1, by our reader, the file's size and
the time of the export. A consumer that is not installed is left out::

    python -m benchmarks.consumers [--formats mitsuba radiance klems merl openpbr ...] [--quick]

With ``--balls`` instead: twenty materials as OpenPBR and glTF, by shaded balls beside the measurement's, whose mean
colour difference (Delta E ITP, ITU-R BT.2124) over the ball and its 95 % quantile are printed::

    python -m benchmarks.consumers --balls

With ``--cells`` instead: how many cells at least any tensor tree needs to lose 1 % below 60 degrees and 3 % below 80,
since Radiance answers with a cell's one value. Cubes of sides h lose (integral of w |grad f|^2 h^2 / 12) and number
(integral of h^-d); the best sides give the bound, by random pairs, its parts for either mask alone::

    python -m benchmarks.consumers --cells
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.compare.appearance import appearance
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.shirley_chiu import disk_to_square
from photogonio.reconstruct.export.formats import find_format
from photogonio.reconstruct.export.loss import MASKS, pairs
from photogonio.reconstruct.export.radiance_tree import tree_look
from photogonio.reconstruct.lobes.lobe import Lobe

PAIRS = 2500
F0, ONE = np.array([0.04, 0.04, 0.04]), np.ones(3)
METAL, GROUND = np.array([0.9, 0.7, 0.4]), np.array([0.5, 0.3, 0.15])
RADIANCE = """
import json, sys
import pyradiance.bsdf as bsdf
known = bsdf.load_file(sys.argv[1])
print(json.dumps([float(bsdf.query(known, *pair)[1]) for pair in json.loads(sys.stdin.read())]))
"""
FORMATS = ("mitsuba", "radiance", "klems", "merl", "openpbr", "gltf", "modes", "csv", "pabopto")
Ask = Callable[[Path, np.ndarray, np.ndarray], np.ndarray]  # file, incident, exit (n, 3) -> (n, c), 1/sr


def materials() -> dict[str, Brdf]:
    """By name, in R, G and B."""
    lobes = {
        "matte": (),
        **{f"gloss {a:g}": (Lobe(a, F0, ONE),) for a in (0.3, 0.2, 0.1, 0.05)},
        "coat 0.4": (Lobe(0.4, F0, ONE, "coat", fresnel="dielectric", ground=GROUND),),
        "coat 0.15": (Lobe(0.15, F0, ONE, "coat", fresnel="dielectric", ground=GROUND),),
        "metal 0.3": (Lobe(0.3, METAL, ONE),),
        "metal 0.1": (Lobe(0.1, METAL, ONE),),
        "retro": (Lobe(0.15, ONE, 0.1 * ONE, "retro"),),
        "brushed": (Lobe((0.45, 0.15), F0, ONE, azimuth=0.5),),
        "brushed metal": (Lobe((0.3, 0.1), METAL, ONE, azimuth=0.5),),
    }
    return {
        name: _brdf(some, bare=name.startswith(("coat", "metal", "brushed metal")))
        for name, some in lobes.items()
    }


def more_materials() -> dict[str, Brdf]:
    """Eight beside :func:`materials`, at roughnesses between theirs."""
    lobes = {
        "gloss 0.4": (Lobe(0.4, F0, ONE),),
        "gloss 0.14": (Lobe(0.14, F0, ONE),),
        "coat 0.25": (Lobe(0.25, F0, ONE, "coat", fresnel="dielectric", ground=GROUND),),
        "coat 0.08": (Lobe(0.08, F0, ONE, "coat", fresnel="dielectric", ground=GROUND),),
        "metal 0.5": (Lobe(0.5, METAL, ONE),),
        "metal 0.2": (Lobe(0.2, METAL, ONE),),
        "retro 0.3": (Lobe(0.3, ONE, 0.1 * ONE, "retro"),),
        "brushed 0.4": (Lobe((0.4, 0.12), F0, ONE, azimuth=1.1),),
    }
    return {name: _brdf(some, bare=name.startswith(("coat", "metal"))) for name, some in lobes.items()}


def balls(name: str, brdf: Brdf, folder: Path) -> dict[str, float]:
    """How different an export's shaded ball looks: see :func:`photogonio.compare.appearance.appearance`."""
    form = find_format(name)
    path = folder / f"a{form.suffix}"
    form.write(brdf, path)
    return appearance(form.read(path), brdf, brdf.channels).to_dict()


def tell_balls() -> None:
    print("| format | material | Delta E ITP mean | 95 % |")
    print("|---|---|---|---|")
    for name in ("openpbr", "gltf"):
        means = []
        for material, brdf in {**materials(), **more_materials()}.items():
            with tempfile.TemporaryDirectory() as folder:
                found = balls(name, brdf, Path(folder))
            means.append(found["delta_e_itp_mean"])
            row = f"| {name} | {material} | {found['delta_e_itp_mean']:.2f} "
            print(f"{row}| {found['delta_e_itp_95']:.2f} |", flush=True)
        print(f"| {name} | mean of {len(means)} | {np.mean(means):.2f} | |", flush=True)


def least_cells(brdf: Brdf, mask: float, asked: float, count: int = 100_000) -> float:
    """Cells of the best tree that loses ``asked`` of f, relative rms below ``mask`` degrees and gray; see above.

    Any cubes may stand side by side there, wherever and however large; halves of halves do no better.
    """
    axes = 4 if brdf.turning else 3
    rng = np.random.default_rng(2)
    incident, exit, weight = pairs(np.radians(mask), rng, isotropic=axes == 3, count=count)
    if axes == 3:  # the incident polar angle alone: sin d(sin) of 2 pi, and half of it is the first axis
        place = np.column_stack([0.5 - 0.5 * incident[:, 0], *disk_to_square(-exit[:, 0], -exit[:, 1])])
        volume, share = weight / (4.0 * np.pi**2 * incident[:, 0]) / count, incident[:, 0]
    else:
        squares = *disk_to_square(-incident[:, 0], -incident[:, 1]), *disk_to_square(exit[:, 0], exit[:, 1])
        place, volume = np.column_stack(squares), weight / np.pi**2 / count
        share = np.ones(len(place))
    look, step = tree_look(brdf, axes), 1e-5
    place = np.clip(place, 2.0 * step, 1.0 - 2.0 * step)
    slope = sum(
        ((look(place + one)[0] - look(place - one)[0]) / (2.0 * step)) ** 2 for one in step * np.eye(axes)
    )
    within = (volume @ (share * slope) ** (axes / (axes + 2.0))) ** ((axes + 2.0) / axes)
    return float((within / (12.0 * volume @ (share * look(place)[0] ** 2)) / asked**2) ** (0.5 * axes))


def tell_cells(names: Iterable[str]) -> None:
    print("| material | cells for 1 % below 60 degrees | for 3 % below 80 |")
    print("|---|---|---|")
    for name in names:
        few, many = (least_cells(materials()[name], *asked) for asked in ((60.0, 0.01), (80.0, 0.03)))
        print(f"| {name} | {few:.2g} | {many:.2g} |", flush=True)


def _brdf(lobes: tuple[Lobe, ...], *, bare: bool) -> Brdf:
    base = np.zeros((1, 3)) if bare else 2.0 * GROUND[None]  # the first mode is 1 / (2 pi)
    return Brdf(0, ("R", "G", "B"), np.zeros((1, 3), int), base, np.zeros((1, 3)), lobes=lobes)


def by_mitsuba(path: Path, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    material = mi.load_dict({"type": "measured", "filename": str(path)})
    found = []
    for i, r in zip(incident, exit, strict=True):
        point = mi.SurfaceInteraction3f()
        point.wi = mi.Vector3f(*i)
        found.append(np.array(material.eval(mi.BSDFContext(), point, mi.Vector3f(*r))) / r[2])
    return np.array(found)


def by_radiance(path: Path, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """In a process of its own, since the library ends it where a file is no good."""
    angles = [[np.arccos(v[:, 2]), np.arctan2(v[:, 1], v[:, 0])] for v in (incident, exit)]
    given = json.dumps(np.degrees(np.vstack(angles)).T.tolist())
    command = [sys.executable, "-c", RADIANCE, str(path)]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=True)
    return np.array(json.loads(done.stdout))[:, None]


CONSUMERS: dict[str, tuple[str, Ask]] = {
    "mitsuba": ("mitsuba", by_mitsuba),
    "radiance": ("pyradiance", by_radiance),
    "klems": ("pyradiance", by_radiance),
}


def measure(name: str, brdf: Brdf, folder: Path, count: int) -> tuple[str, list[float], int, float]:
    """Who was asked; rms below 60 and 80 degrees and the albedo's departure, per cent; bytes and seconds."""
    form = find_format("radiance", "klems") if name == "klems" else find_format(name)
    path = folder / f"a{form.suffix}"
    start = time.process_time()
    _, loss = form.put(brdf, path)
    seconds = time.process_time() - start
    package, ask = CONSUMERS.get(name, ("", None))
    if ask is not None and importlib.util.find_spec(package) is None:
        ask = None
    rms = list(loss.rms)
    if ask is not None:
        rms = [
            _rms(brdf, lambda i, r: ask(path, i, r), form.convert, np.radians(mask), count) for mask in MASKS
        ]
    off = max((ratio - 1.0 for ratio in loss.albedo), key=abs)
    files = path.iterdir() if path.is_dir() else [path]
    size = sum(file.stat().st_size for file in files)
    return package if ask is not None else "our reader", [100 * one for one in (*rms, off)], size, seconds


def _rms(brdf: Brdf, asked, convert, mask: float, count: int) -> float:
    incident, exit, weight = pairs(mask, np.random.default_rng(5), isotropic=not brdf.turning, count=count)
    f0, f = np.maximum(brdf(incident, exit), 0.0), asked(incident, exit)
    f0 = f0 if convert is None else convert(brdf, f0)
    return float(np.sqrt((weight @ (f - f0) ** 2 / (weight @ f0**2)).max()))


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--formats", nargs="+", choices=FORMATS, default=FORMATS)
    parser.add_argument("--materials", nargs="+", choices=tuple(materials()), default=tuple(materials()))
    parser.add_argument("--quick", action="store_true", help="two formats of two materials")
    parser.add_argument("--balls", action="store_true", help="colour differences of OpenPBR's and glTF's")
    parser.add_argument("--cells", action="store_true", help="cells that a tensor tree needs at least")
    options = parser.parse_args(arguments)
    if options.cells:
        tell_cells(options.materials)
        return
    if options.balls:
        tell_balls()
        return
    names, formats, count = options.materials, options.formats, PAIRS
    if options.quick:
        names, formats, count = ("matte", "gloss 0.3"), ("mitsuba", "csv"), 200
    print("| format | asked | material | < 60, % | < 80, % | albedo, % | MB | CPU s |")
    print("|---|---|---|---|---|---|---|---|")
    for name in formats:
        for material in names:
            with tempfile.TemporaryDirectory() as folder:
                try:
                    who, (low, high, off), size, seconds = measure(
                        name, materials()[material], Path(folder), count
                    )
                except InputError as refused:
                    print(f"| {name} | | {material} | {refused} | | | | |", flush=True)
                    continue
            row = f"| {name} | {who} | {material} | {low:.2f} | {high:.2f} | {off:+.2f} "
            print(f"{row}| {size / 1e6:.2f} | {seconds:.1f} |", flush=True)


if __name__ == "__main__":
    main()
