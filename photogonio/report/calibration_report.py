"""A calibration as a page: verdict, warnings, contact sheet, the set-up to turn, and tables."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from photogonio import __version__
from photogonio.calib.setup import Setup
from photogonio.report.calibration_page import setup_sections
from photogonio.report.html import interactive_text, render_report
from photogonio.report.sections import Report, Table
from photogonio.report.trust import setup_faults
from photogonio.report.verdict import advice_of
from photogonio.report.viewer.contact_sheet import contact_sheet
from photogonio.report.viewer.set_up_scene import set_up_scene


def calibration_html(setup: Setup, prints: Mapping[str, np.ndarray], *, name: str) -> str:
    """The page of a calibration; ``prints`` are small pictures of photos."""
    told = [one for one in setup.diagnoses if not one.allowed]
    left_out = [(photo.name, photo.reason) for photo in setup.left_out]
    return render_report(
        Report(
            title=name,
            kind="calibration",
            lead=_lead(setup),
            verdict=(
                ("What it is", _lead(setup)),
                ("How sure", _sure(setup)),
                ("What is missing", _missing(setup)),
                ("What to do next", _next(setup, advice_of(told))),
            ),
            told=interactive_text({"scene": set_up_scene(setup)}),
            parts=("set-up",),
            prints=contact_sheet(setup, setup.left_out, prints),
            calibration=setup_sections(setup),
            warnings=[(one.code, one.message) for one in setup.diagnoses],
            left_out=left_out,
            provenance=_provenance(setup),
        )
    )


def _lead(setup: Setup) -> str:
    lamps = {view.light.id for view in setup.views}
    scale = "absolute" if setup.scale == "absolute" else "relative: no white reference"
    photos = f"{len(setup.views)} photos of the sample under {len(lamps)} lights"
    return f"{photos}, {len(setup.boards)} of the bare board; scale {scale}."


def _sure(setup: Setup) -> str:
    faults = setup_faults(setup)
    if faults:
        return "Not to be trusted: " + "; ".join(one.found for one in faults) + "."
    rms = np.array([one.pose_rms for some in (setup.views, setup.boards) for one in some])
    rms = rms[np.isfinite(rms)]
    said = (
        [f"The board lies {np.median(rms):.2f} px from where it was found, in the middle photo"]
        if len(rms)
        else []
    )
    relative = [
        float(np.max(view.strength_error / np.maximum(view.strength, 1e-300))) for view in setup.views
    ]
    if setup.scale == "absolute" and relative:
        said.append(f"lamps' strengths are known to {100 * np.median(relative):.2g} % (standard error)")
    return "; ".join(said) + "." if said else "Nothing tells."


def _missing(setup: Setup) -> str:
    missing = [] if setup.scale == "absolute" else ["a white reference"]
    missing += [f"{len(setup.left_out)} photos left out"] if setup.left_out else []
    missing += [] if setup.boards else ["photos of the board alone, which tell the lens best"]
    return "; ".join(missing).capitalize() + "." if missing else "Nothing that was looked for."


def _next(setup: Setup, advice: list[str]) -> str:
    faults = setup_faults(setup)
    if faults:
        return (
            "Look for the likeliest cause: " + "; or ".join(dict.fromkeys(one.cause for one in faults)) + "."
        )
    return " ".join(advice[:3]) if advice else "Process it: nothing was found that asks for other photos."


def _provenance(setup: Setup) -> Table:
    inputs = setup.source.get("inputs")
    rows = [("program", f"photogonio {__version__}"), ("command", str(setup.source.get("command", "")))]
    rows += [
        (str(one), f"SHA-256 {digest}")
        for one, digest in (inputs if isinstance(inputs, dict) else {}).items()
    ]
    return Table(("what", "which"), rows)
