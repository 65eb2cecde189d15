"""The jobs of the command line, from Python."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from photogonio import pipeline
from photogonio.face.measured import MeasuredBrdf
from photogonio.options import Options
from photogonio.reconstruct.goniometer.told import Told
from photogonio.result import Result
from photogonio.system.progress import Reporter


def process(
    folder: str | Path,
    out: str | Path | None = None,
    options: Options | None = None,
    reporter: Reporter | None = None,
) -> Result:
    """Photo set to coefficients, ``result.brdf``; with ``out``, also to files there (docs/cli.md).

    Raises:
        InputError: the set cannot be used, or what was asked cannot be done. Nothing is written then.
    """
    return _faced(pipeline.process(folder, out, options, reporter))


def fit(
    table: str | Path,
    out: str | Path | None = None,
    options: Options | None = None,
    *,
    told: Told | None = None,
    reporter: Reporter | None = None,
) -> Result:
    """Coefficients of tabulated measurements, read as ``told``, or of a facet table (.npz) that ``process`` left.

    Raises:
        InputError: the table cannot be used, or what was asked cannot be done. Nothing is written then.
    """
    return _faced(pipeline.fit(table, out, options, told=told, reporter=reporter))


def _faced(result: Result) -> Result:
    """With a BRDF that can be drawn, compared and exported."""
    source = {"name": result.name} | result.provenance.to_dict()
    brdf = replace(result.brdf, source=result.brdf.source | source)
    return replace(result, coloured=MeasuredBrdf.of(brdf))
