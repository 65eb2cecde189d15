"""All that may be told of a set or a table, by code: docs/diagnoses.md is made of it (``python -m`` this module)."""

from __future__ import annotations

from collections.abc import Sequence

from photogonio.calib.diagnose.registry import Stage, entries
from photogonio.calib.rig import codes as rig
from photogonio.capture import codes
from photogonio.capture.diagnosis import Entry
from photogonio.reconstruct.goniometer import codes as tables

FIT = (
    Entry(
        "lights-turned",
        "Lights were turned to where the sample's shading has them: a polished ball stood elsewhere when it was "
        "photographed, or is not where the manifest says, or small balls alone told near lamps, to a degree or so.",
        "Put the sample on a printed board: its paper tells lamps to a tenth of a degree.",
    ),
    Entry(
        "surroundings-unknown",
        "How much light the surroundings throw on the sample cannot be known: pixels where it may be too much are "
        "left out.",
        "Put the set on black cloth, or the sample on a printed board.",
    ),
    Entry(
        "photo-left-out",
        "A photo gave the fit nothing, or contradicts the others; it is left out.",
        "Nothing.",
    ),
    Entry(
        "photo-rescaled",
        "A photo's values are all off the other photos' by one factor, and were corrected.",
        "Check that photo's exposure, and what lies on its white patch.",
    ),
    Entry(
        "sessions-contradict",
        "The sessions that `add` was given are on scales that differ by more than their errors; the error of all of f "
        "is stated as much larger.",
        "A white patch was dirty, clipped or in shadow in one of them, or a `reflectance` is wrong; or it is not the "
        "same sample.",
        least=3.0,
        source="the difference over its standard error",
    ),
    Entry(
        "sample-clipped",
        "The sample is clipped in some photos: the peak of a gloss was lost, and is only as sure as its flanks.",
        "Shorter exposures, or brackets.",
    ),
    Entry(
        "photos-contradict",
        "The photos contradict one another at the same directions, or show the sample in different colours.",
        "Something moved between the photos, a light is another than it is taken for, or the sample is not alike "
        "everywhere.",
    ),
    Entry(
        "retro-unseen",
        "No photo looks near the light's own direction: a retro-reflective peak there was not seen.",
        "Add photos with the lamp close beside the camera, or know that the surface was not seen there.",
    ),
    Entry(
        "mirror-unseen",
        "No photo looks near the mirror direction, or only where light and camera stand together, as with a flash "
        "beside the lens: a gloss there was not seen.",
        "Add photos with the lamp opposite the camera, or know that the surface was not seen there.",
    ),
    Entry(
        "gloss-extrapolated",
        "The gloss was seen from above alone: how it grows toward grazing is extrapolated, and the stated error says "
        "how far it may be off.",
        "Put the camera lower, or lamps lower opposite it.",
    ),
    Entry(
        "gloss-unseen-at-grazing",
        "Light and camera were never far apart. Cloth's sheen and a dark film's gloss show beyond some 110 degrees "
        "alone, and are missing in the result if there are any.",
        "Put the camera lower, or lamps lower opposite it.",
    ),
    Entry(
        "physics-contradicted",
        "The data ask for more light out than came in, or for less than none, by more than their errors allow.",
        "A lamp's strength is wrong: a clipped or shaded patch, a wrong reflectance; or light from elsewhere.",
    ),
    Entry(
        "physics-held",
        "The plain fit broke physics by more than its error, and was held to it.",
        "Look where the data reach: beyond them the fit is an extrapolation.",
    ),
)
ROOMS = (
    ("Photos as they are read", codes.ENTRIES),
    ("Tables of measurements", tables.ENTRIES),
    ("The manifest and the photos", entries(Stage.LOOK, Stage.PLACED, Stage.CLOSER, Stage.MANIFEST)),
    ("The camera and the board", entries(Stage.CAMERA)),
    ("What single photos show", entries(Stage.PHOTO)),
    ("Lamps and lens", entries(Stage.LIGHT)),
    ("Strengths, places, and what is left", entries(Stage.LAMP, Stage.STRENGTH, Stage.PLACES)),
    ("The fit", FIT),
    ("Many sets of one rig", rig.ENTRIES),
)
ENTRIES = tuple(entry for _, entries in ROOMS for entry in entries)
_HEAD = """# What may be told, and what to do

Every warning has a code, which `setup.json`, `--json` and the report name. This page says what it means and what to do.
It is made from the program's own list: `python -m photogonio.report.diagnoses > docs/diagnoses.md`.
"""


def to_markdown(rooms: Sequence[tuple[str, Sequence[Entry]]] = ROOMS) -> str:
    """The page docs/diagnoses.md."""
    parts = [_HEAD]
    for title, listed in rooms:
        parts.append(f"## {title}\n\n| code | what it means | what to do | told from |\n|---|---|---|---|\n")
        parts[-1] += "".join(
            f"| `{one.code}` | {one.means} | {one.advice} | {_threshold(one)} |\n" for one in listed
        )
    return "\n".join(parts)


def _threshold(entry: Entry) -> str:
    """From what amount on it is told, and why so."""
    bounds = [f"{entry.least:g}"] * (entry.least > 0) + [f"{entry.sigmas:g} standard errors"] * (
        entry.sigmas > 0
    )
    return " and ".join(bounds) + (f" ({entry.source})" if entry.source else "")


if __name__ == "__main__":
    print(to_markdown(), end="")
