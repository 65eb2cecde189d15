"""What may be told of sets of one rig."""

from __future__ import annotations

from photogonio.calib.rig.pooling import CONTRADICTS
from photogonio.capture.diagnosis import Entry

DIFFERS = "differs-from-rig"
ENTRIES = (
    Entry(
        DIFFERS,
        "Of many sets that say to be of one rig (`batch --pool`), this one contradicts the others in what is named: "
        "the lens was turned, a lamp or the paper exchanged. It is left out of what they have in common, and found by "
        f"itself. A set of the rig would be as far off by a chance of less than {CONTRADICTS:g}.",
        "Nothing, if so it was. Else see what is the matter with the set.",
    ),
)
