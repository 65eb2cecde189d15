"""The jobs of the command line, from Python."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import ParamSpec

from photogonio import pipeline, tabulated
from photogonio.face.measured import MeasuredBrdf
from photogonio.result import Result

Asked = ParamSpec("Asked")


def _facing(job: Callable[Asked, Result]) -> Callable[Asked, Result]:
    """The same with a BRDF that can be drawn, compared and exported."""

    @wraps(job)
    def faced(*args: Asked.args, **kwargs: Asked.kwargs) -> Result:
        result = job(*args, **kwargs)
        source = {"name": result.name} | result.provenance.to_dict()
        brdf = replace(result.brdf, source=result.brdf.source | source)
        return replace(result, coloured=MeasuredBrdf.of(brdf))

    return faced


process = _facing(pipeline.process)
fit = _facing(tabulated.fit)
