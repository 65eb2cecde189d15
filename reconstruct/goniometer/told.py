"""What the user tells of a table that the table does not say itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

QUANTITIES = ("brdf", "brdf-cos", "brdf-cos-cos", "brdf-cos-incident", "reflectance-factor", "percent")
ANGLES = ("degrees", "radians", "gradians")
AZIMUTHS = ("lamp", "mirror")


@dataclass(frozen=True, slots=True)
class Told:
    """Names, rows, units and conventions of a table; None: not told."""

    columns: Mapping[str, str] = field(default_factory=dict)  # the reader's name -> the file's header
    where: Sequence[tuple[str, str]] = ()  # header, value: rows to take
    quantity: str | None = (
        None  # one of QUANTITIES: what the values are; None: brdf, doubted where a header says another
    )
    angles: str | None = None  # one of ANGLES; None: degrees, refused where they look like radians
    azimuth: str | None = None  # one of AZIMUTHS: the side where phi_r - phi_i is 0; None: the lamp's
    channel_by: str | None = None  # header whose values become channels

    @property
    def values_are(self) -> str:
        """What the values are taken for."""
        return self.quantity or "brdf"

    def to_dict(self) -> dict[str, object]:
        """What was told, as command-line options; what was not is None."""
        pairs = {"columns": self.columns, "where": dict(self.where)}
        joined: dict[str, object] = {
            name: ",".join(f"{a}={b}" for a, b in told.items()) if told else None
            for name, told in pairs.items()
        }
        return joined | {
            "quantity": self.quantity,
            "angles": self.angles,
            "azimuth": self.azimuth,
            "channel-by": self.channel_by,
        }


UNTOLD = Told()
