"""What the files of a set say of themselves against what its manifest says, in words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from photogonio.capture.containers.tone import LINEAR, SRGB, Curve, Tone, difference
from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.files.images import Header
from photogonio.capture.photoset import MANIFEST, PhotoSet, Radiometry

APART = 0.02  # relative difference of two curves that is told
NAMED = 4  # photos in a line


def notes(photoset: PhotoSet, headers: Mapping[str, Header]) -> tuple[str, ...]:
    """How the photos are read: their tone curves where the manifest leaves them to the files, gain maps and so on."""
    found = [f"{photos(files)} {note}" for note, files in grouped((f, h.notes) for f, h in headers.items())]
    if photoset.radiometry.encoding == "auto":
        curves = grouped(
            (file, (f"{head.tone.name} ({head.tone.source})",)) for file, head in headers.items()
        )
        found += [f"tone curve {curve} in {photos(files)}" for curve, files in curves]
    if photoset.radiometry.colour == "camera" and any("ICC" in head.tone.source for head in headers.values()):
        found.append(
            "of the photos' ICC profiles the tone curves are used alone: colours are the camera's own"
        )
    return tuple(found)


def doubts(photoset: PhotoSet, headers: Mapping[str, Header]) -> tuple[Diagnosis, ...]:
    """What the files say that the manifest contradicts, or that nobody says."""
    found = [
        Diagnosis("file-doubtful", f"{photos(files)} {doubt}", amount=len(files), views=tuple(files))
        for doubt, files in grouped((f, h.doubts) for f, h in headers.items())
    ]
    curve = stated(photoset.radiometry)
    if curve is not None:
        key = f'{MANIFEST}: [radiometry] encoding = "{photoset.radiometry.encoding}"'
        against = ((f, contradiction(curve, h.tone)) for f, h in headers.items())
        for what, files in grouped(against):
            message = (
                f'{photos(files)} {what}; {key} is obeyed. encoding = "auto" would take what the files say'
            )
            found.append(Diagnosis("encoding-contradicted", message, amount=len(files), views=tuple(files)))
    if photoset.radiometry.encoding == "auto":
        silent = [
            file for file, head in headers.items() if not head.tone.told and head.tone.source == "8 bits"
        ]
        if silent:
            message = (
                f"{photos(silent)} of 8 bits, name no tone curve, nor does [radiometry] encoding: read as sRGB; set "
                'encoding = "linear" if their codes are in proportion to light'
            )
            found.append(Diagnosis("encoding-untold", message, amount=len(silent), views=tuple(silent)))
    return tuple(found)


def stated(radiometry: Radiometry) -> Curve | None:
    """The curve that the manifest names; None if it leaves it open."""
    if radiometry.encoding == "gamma" and radiometry.gamma is not None:
        return Curve("gamma", (radiometry.gamma,))
    return {"linear": LINEAR, "srgb": SRGB}.get(radiometry.encoding)


def contradiction(curve: Curve, tone: Tone) -> tuple[str, ...]:
    """What a file says that is not ``curve``, if anything."""
    apart = max(difference(curve, own) for own in tone.curves)
    if not tone.told or apart <= APART:
        return ()
    return (f"are {tone.name} by their {tone.source}",)


def grouped(words: Iterable[tuple[str, tuple[str, ...]]]) -> list[tuple[str, list[str]]]:
    """Files by what is said of them, in order of appearance."""
    found: dict[str, list[str]] = {}
    for file, lines in words:
        for line in lines:
            found.setdefault(line, []).append(file)
    return list(found.items())


def photos(files: list[str]) -> str:
    """``3 photos (a, b, c)``."""
    count = "1 photo" if len(files) == 1 else f"{len(files)} photos"
    return f"{count} ({', '.join(files[:NAMED])}{', ...' if len(files) > NAMED else ''})"
