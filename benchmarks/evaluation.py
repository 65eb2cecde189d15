"""How fast expansions are summed: pairs a second, against a design matrix and against SCATMECH.

    python -m benchmarks.evaluation [--quick] [--ptfe FILE] [--old FILE] [--threads N]

Two tables of the same file go to SCATMECH: all its rows, as anybody would use it, and the rows of the BRDF alone, so
that both sides sum the same 40 modes. SCATMECH is asked pair by pair, the only way it offers.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.scatmech import ScatmechTable, read_scatmech, scatmech_brdf, write_scatmech
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.parallel import cores
from photogonio.reconstruct.represent.developed import developed

PTFE = Path(__file__).parents[2] / "shared" / "data" / "nist-ptfe" / "PTFE.532.coeff.csv"


def random_pairs(count: int, seed: int = 0) -> np.ndarray:
    """(3, count) theta_i, theta_r, dphi, even over solid angle."""
    rng = np.random.default_rng(seed)
    return np.stack([*np.arccos(rng.random((2, count))), rng.uniform(-np.pi, np.pi, count)])


def best_time(
    task: Callable[[], object], repeats: int, clock: Callable[[], float] = time.perf_counter
) -> float:
    """Seconds of the fastest of several runs, after one that is not counted."""
    task()
    times = []
    for _ in range(repeats):
        start = clock()
        task()
        times.append(clock() - start)
    return min(times)


def rate(order: int, channels: int, count: int, repeats: int, threads: int | None) -> tuple[float, float]:
    """Pairs a second of an isotropic expansion: by the clock, and by the processor time of one core.

    The second is what an idle machine gives a core; the first falls when others use the machine.
    """
    modes = m.isotropic_modes(order)
    values = np.random.default_rng(1).normal(size=(len(modes), channels))
    theta_i, theta_r, dphi = random_pairs(count)

    def task() -> None:
        m.evaluate_isotropic(modes, values, theta_i, theta_r, dphi, threads=threads)

    return count / best_time(task, repeats), count / best_time(task, repeats, time.process_time)


def product_rate(order: int, channels: int, count: int, repeats: int) -> tuple[float, float]:
    """Pairs a second of the design matrix times coefficients, and the largest difference to ours, relative."""
    modes = m.isotropic_modes(order)
    values = np.random.default_rng(1).normal(size=(len(modes), channels))
    angles = random_pairs(count)
    seconds = best_time(lambda: m.isotropic_design(order, *angles) @ values, repeats)
    theirs, ours = m.isotropic_design(order, *angles) @ values, m.evaluate_isotropic(modes, values, *angles)
    return count / seconds, float(np.abs(ours - theirs).max() / np.abs(theirs).max())


def scatmech_comparison(table: ScatmechTable, count: int, single: int, repeats: int) -> dict[str, float]:
    """Pairs a second of both for one table, and the largest relative difference between their values."""
    from pySCATMECH.brdf import BRDF_Model

    brdf: Brdf = scatmech_brdf(table)
    theta_i, theta_r, dphi = random_pairs(count)
    ours = count / best_time(lambda: brdf.evaluate(theta_i, 0.0, theta_r, dphi), repeats)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "coefficients.csv"
        write_scatmech(path, table)
        model = BRDF_Model("ZernikeExpansion_BRDF_Model", coefficientfile=str(path))
        pairs = np.stack([theta_i, theta_r, dphi - np.pi], axis=1)[
            :single
        ].tolist()  # theirs: 0 is the mirror
        theirs = np.array([model.BRDF(*pair) for pair in pairs])
        seconds = best_time(lambda: [model.BRDF(*pair) for pair in pairs], repeats)
    values = brdf.evaluate(theta_i[:single], 0.0, theta_r[:single], dphi[:single])[:, 0]
    return {
        "ours": ours,
        "theirs": single / seconds,
        "difference": float(np.abs(values / theirs - 1).max()),
    }


def plastic() -> Brdf:
    """What is found of a plastic ball: order 0 and a coat over a diffuse ground."""
    one = np.ones(3)
    coat = Lobe(0.08, 0.04 * one, one, "coat", fresnel="dielectric", ground=np.array([0.35, 0.2, 0.1]))
    modes, none = m.isotropic_modes(0), np.zeros((1, 3))
    return Brdf(0, ("R", "G", "B"), modes, np.full((1, 3), 0.02), none, lobes=(coat,))


def versions(count: int, repeats: int, old: Path | None) -> tuple[float, float, float, Brdf]:
    """Pairs a second of a plastic ball's file as it was found, and of version 1 of the same (``old``, or what this
    program writes), by the clock; how many times as fast the first is by the processor's time; and the second.

    Both are asked for the same pairs, in turns, so that whatever else the machine does falls on both.
    """
    found = plastic()
    first = developed(found).brdf if old is None else load_brdf(old)
    theta_i, theta_r, dphi = random_pairs(count)

    def seconds(brdf: Brdf) -> tuple[float, float]:
        clock, core = time.perf_counter(), time.process_time()
        brdf.evaluate(theta_i, 0.0, theta_r, dphi)
        return (time.perf_counter() - clock) / count, (time.process_time() - core) / count

    best = np.array([(seconds(found), seconds(first)) for _ in range(repeats + 1)][1:]).min(0)  # (2, 2)
    return 1.0 / best[0, 0], 1.0 / best[1, 0], float(best[1, 1] / best[0, 1]), first


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few pairs: shows that it runs, not how fast")
    parser.add_argument("--ptfe", type=Path, default=PTFE, help="a SCATMECH coefficient file")
    parser.add_argument("--old", type=Path, default=None, help="a plastic ball's file of version 1")
    parser.add_argument("--threads", type=int, default=None)
    options = parser.parse_args(arguments)
    count, single, repeats = (20_000, 50, 1) if options.quick else (4_000_000, 3_000, 7)
    print(
        f"million pairs a second, {options.threads or cores()} threads, best of {repeats} runs of {count} pairs"
    )
    seconds = []
    cases = ((2, 3), (8, 1), (8, 3), (16, 3))
    for order, channels in cases:
        clock, core = rate(order, channels, count, repeats, options.threads)
        seconds.append(count / core)
        print(
            f"  order {order:2d}, {channels} channels: {clock / 1e6:8.1f}, a core's time alone {core / 1e6:8.1f}"
        )
        product, difference = product_rate(order, channels, count // 20, repeats)
        print(
            f"    design matrix and product {product / 1e6:8.1f}, ratio {clock / product:.1f}, within {difference:.1e}"
        )
    modes = [len(m.isotropic_modes(order)) for order, channels in cases if channels == 3]
    power = np.polyfit(np.log(modes), np.log(np.delete(seconds, 1)), 1)[0]
    print(f"  time ~ modes^{power:.2f}")
    found, first, ratio, brdf = versions(count // 10, 2 * repeats, options.old)
    print(
        f"  a plastic ball as found, order 0 and a coat: {found / 1e6:.1f}; as {len(brdf.modes)} modes and "
        f"{len(brdf.lobes)} GGX lobes {first / 1e6:.2f}, ratio {found / first:.1f}, by a core's time {ratio:.1f}"
    )
    try:
        import pySCATMECH  # noqa: F401
    except ImportError:
        print("SCATMECH: left out, pyscatmech is not installed")
        return
    if not options.ptfe.is_file():
        print(f"SCATMECH: left out, there is no {options.ptfe.name}")
        return
    table = read_scatmech(options.ptfe)
    plain = ScatmechTable(table.rows[table.unpolarised], table.values[table.unpolarised])
    for name, each in (("all rows", table), ("BRDF rows", plain)):
        found = scatmech_comparison(each, count, single, repeats)
        print(
            f"  {options.ptfe.name}, {name}: ours {found['ours'] / 1e6:.1f}, SCATMECH {found['theirs'] / 1e6:.4f}, "
            f"ratio {found['ours'] / found['theirs']:.0f}, values within {found['difference']:.1e}"
        )


if __name__ == "__main__":
    main()
