"""What the user tells of a table that the table does not say itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from photogonio.capture.errors import InputError

QUANTITIES = ("brdf", "brdf-cos", "brdf-cos-cos", "brdf-cos-incident", "reflectance-factor", "percent")
ANGLES = ("degrees", "radians", "gradians")
COLUMNS = ("theta_i", "phi_i", "theta_r", "phi_r")
AZIMUTHS = ("lamp", "mirror")


@dataclass(frozen=True, slots=True)
class Told:
    """Names, rows, units and conventions of a table; None: not told."""

    columns: Mapping[str, str] = field(default_factory=dict)  # the reader's name -> the file's header
    where: Sequence[tuple[str, str]] = ()  # header, value: rows to take
    quantity: str | None = (
        None  # one of QUANTITIES: what the values are; None: brdf, doubted where a header says another
    )
    # one of ANGLES, or some of theta, phi and the columns with a unit each, "theta=degrees,phi=gradians"; None:
    # degrees, refused where they look like another unit
    angles: str | None = None
    azimuth: str | None = None  # one of AZIMUTHS: the side where phi_r - phi_i is 0; None: the lamp's
    channel_by: str | None = None  # header whose values become channels

    @property
    def values_are(self) -> str:
        """What the values are taken for."""
        return self.quantity or "brdf"

    def units(self) -> dict[str, str]:
        """The unit of each angle that one is told of.

        Raises:
            InputError: it is none.
        """
        if self.angles is None:
            return {}
        if self.angles in ANGLES:
            return dict.fromkeys(COLUMNS, self.angles)
        found: dict[str, str] = {}
        for part in self.angles.split(","):
            name, _, unit = part.strip().partition("=")
            columns = [one for one in COLUMNS if name in (one, one.split("_")[0])]
            if not columns or unit not in ANGLES:
                raise InputError(
                    f"--angles {self.angles}",
                    f"expected {', '.join(ANGLES)}, or theta=UNIT,phi=UNIT where they differ",
                )
            found |= dict.fromkeys(columns, unit)
        return found

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
