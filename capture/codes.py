"""What the set's own frames and a first look at its photos may tell, by code (docs/diagnoses.md)."""

from __future__ import annotations

from photogonio.capture.diagnosis import Entry

ENTRIES = (
    Entry(
        "exposure-assumed",
        "Some photos say no exposure time, ISO or aperture, neither in the manifest nor in EXIF; they are taken as the "
        "others'.",
        "Nothing, where every photo shows white patch or paper, which tell how much light there was. Else say them in "
        "the manifest.",
    ),
    Entry(
        "exposure-steps",
        "The camera names its times or apertures in thirds or halves of a stop: the true steps are taken, not the "
        "rounded names.",
        "Nothing, if the camera steps so; else write exposures in the manifest.",
    ),
    Entry(
        "encoding-contradicted",
        "The files say another encoding than the manifest, which is obeyed.",
        'Say `encoding = "auto"`, if the files are right.',
    ),
    Entry(
        "encoding-untold",
        "Neither files of 8 bits nor the manifest say how codes stand for light: they are read as sRGB.",
        'Say `[radiometry] encoding`: `"linear"`, if codes are in proportion to light.',
    ),
    Entry(
        "tone-curve-unsure",
        'With `encoding = "unknown"`, print and paper tell the tone curve, but not how the sample compares with the '
        "paper to a few per cent: no print is as bright as the sample, or the lamps light the sheet too evenly.",
        "Take RAW photos, or brackets; or print the strip of greys of a target. Else: lamps nearer the sheet, some "
        "photos exposed a stop or two darker, the flash of the camera in some.",
        least=0.02,
        source="relative; errors of what the result is quoted to",
    ),
    Entry(
        "tone-not-global",
        'With `encoding = "unknown"`, white paper is dimmer than its lamp\'s light has it where it is bright round '
        "about, and brighter where it is dark: the phone toned its pictures locally, which no one curve undoes.",
        "Take RAW photos (DNG, ProRAW), or turn off HDR, smart tones and scene optimisation.",
        least=0.005,
        source="a power of the light round about, white paper missing by 0.6 % and more; photos toned by 0.15 and 0.3",
    ),
    Entry(
        "file-doubtful",
        "A file says something of itself that cannot be right, or that is not known here.",
        "See what wrote it; take the camera's own file.",
    ),
    Entry(
        "jpeg-as-linear",
        "JPEG photos are read as linear, which no camera writes.",
        'Say `[radiometry] encoding = "srgb"`.',
    ),
    Entry(
        "ambient-camera-moved",
        "Photos with the lamp off name no light and the camera is not said to be still: they are taken off all photos "
        "as if it had not moved.",
        "Say `[camera] fixed = true` if so, or give each ambient photo the `light` whose place it was taken from.",
    ),
    Entry(
        "noise-assumed",
        "The photos are too small or too full to measure their noise; a usual sensor's is assumed.",
        "Give `[radiometry]` noise, or larger photos with unclipped parts.",
    ),
    Entry(
        "unreadable-frame",
        "A dark, flat or ambient frame cannot be read, or is full; it is left out.",
        "Nothing, if there are others of its kind.",
    ),
    Entry(
        "chart-unusable",
        "The colour chart is not found, or does not fit; colours stay the camera's.",
        "Show the chart whole, sharp, evenly lit and unclipped.",
    ),
)
