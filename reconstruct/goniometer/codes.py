"""What may be told of a table, by code."""

from __future__ import annotations

import numpy as np

from photogonio.capture.diagnosis import Entry
from photogonio.reconstruct.goniometer import doubts
from photogonio.reconstruct.symmetry import gains, scans

ENTRIES = (
    Entry(
        "rows-left-out",
        "Rows of a table say nothing, or hold a number that is no measurement: zeros where the detector hid the lamp, "
        "marks of missing values. They are named by their lines.",
        "Look at some of them; `--where` takes others out.",
    ),
    Entry(
        "rows-contradicted",
        "Single rows of a table lie far outside of what all rows around them say: they count for little. They are "
        "named by their directions.",
        "Look at them: dust, a slipped decimal point, a detector that was switched. `--robust off` believes them.",
    ),
    Entry(
        "table-cosine",
        "Exchanged pairs of directions differ, and a cosine explains it; or values fall toward grazing as both cosines "
        "do: they are no BRDF, or the surface is not reciprocal, or darkens, in just that way.",
        "`--quantity brdf-cos` (of the exit angle), `brdf-cos-incident` or `brdf-cos-cos`; `brdf` if they are f.",
        least=1.0 - doubts.COSINE,
        source="tables of known surfaces; of thirty CUReT materials none reaches 0.3",
    ),
    Entry(
        "table-quantity",
        "A table's header names its values as another quantity than f, as which they are read: per cent, a reflectance "
        "factor, cosine-corrected.",
        "`--quantity`, as the header says; `--quantity brdf`, if its values are f all the same.",
    ),
    Entry(
        "table-lamp-side",
        "A table's readings peak toward the lamp, not toward the mirror direction.",
        "`--azimuth mirror`, if azimuths count from the mirror side. A retro-reflective surface is read rightly.",
        least=doubts.PEAK,
        source="NIST's PTFE has 1.06; very rough matte ones up to 1.75",
    ),
    Entry(
        "table-mirrored",
        "A table's peak toward the lamp, or beside the plane of incidence, is a mirror lobe, by the evidence of lobes "
        "with azimuths as read and turned. The result is not to be trusted.",
        "`--azimuth mirror` if they count from the mirror side; `--azimuth lamp` believes the file.",
        least=doubts.MIRRORED,
        source="tables of known glossy surfaces; of thirty CUReT materials and NIST's PTFE none is above 0",
    ),
    Entry(
        "table-slipped",
        "Values of a table, all or from some row on, would agree with one another far better a row or two lower or "
        "higher, by the evidence of smooth surfaces and of lobes. The result is not to be trusted.",
        "Put the column of values back beside its angles: one was lost, or pasted a row off. Or a zero of the angles "
        "is off by a step.",
        least=doubts.SLIPPED,
        source="600 tables of known surfaces, with readings far off among them, reach 22; thirty CUReT materials and "
        "NIST's PTFE are below 0",
    ),
    Entry(
        "table-scan-off",
        "All readings of one incidence, or of a run of lines that lie among others, are the same multiple of what "
        "neighbouring incidences and exchanged pairs say; no surface does that. The result is not to be trusted.",
        "Measure the scan again, or leave it out: another gain, filter or lamp than in the others?",
        least=float(np.exp(scans.FACTOR)),
        source="tables of known surfaces; of thirty CUReT materials and NIST's PTFE none has it",
    ),
    Entry(
        "table-uneven",
        "Every second row of a table, the rows of every second incidence, those on one side of the plane of incidence, "
        "or later ones are a multiple of the others, by the evidence of smooth surfaces and of lobes. The result is "
        "not to be trusted.",
        "Measure again, or bring the rows to one scale: was there another gain, detector or lamp, or did it drift?",
        least=min(doubts.UNEVEN.values()),
        source="620 tables of known surfaces, 360 of them with CUReT's angles and 5 % noise, and thirty CUReT "
        "materials stay below 10; sides of brushed metal at one rotation reach 80",
    ),
    Entry(
        "table-gain",
        "Exchanged pairs of directions differ, and a gain that changes at an angle of exit or incidence, or with the "
        "lines of the table, explains it down to the noise. The result is not to be trusted.",
        "Measure again: did the lamp drift, or was the lit spot larger than the sample, or than the detector's view?",
        least=float(np.exp(gains.FACTOR)),
        source="of thirty CUReT materials none is explained so: they leave 0.19 of the squares and more",
    ),
    Entry(
        "table-not-reciprocal",
        "Exchanged pairs of directions differ by far more than their noise, and by no cosine: of a surface that looks "
        "alike however it is turned they are alike.",
        "Look whether parts of the table are of another gain, lamp, unit or sample. Of a brushed or woven sample, "
        "measure it turned as well.",
        least=doubts.BREACH,
        source="thirty CUReT materials reach 0.29, NIST's PTFE 0.02; brushed metal at one rotation 0.6 to 0.7",
    ),
    Entry(
        "table-much-lost",
        "Rows that are no measurements are a tenth of a table, or all that it has beyond some angle.",
        "Measure there again. Where the others tell the albedo to no better than 2 %, the result is not to be trusted.",
    ),
    Entry(
        "table-saturated",
        "The largest value of a table comes at many pairs of directions, and far more often than the next ones.",
        "Leave the rows out at which the detector was saturated.",
        least=doubts.LEVEL,
        source="tables of known surfaces with noise or cut-off digits; none of thirty CUReT materials has it",
    ),
)
