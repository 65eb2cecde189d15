"""SCATMECH's coefficient file for its ``ZernikeExpansion`` BRDF: one channel."""

from __future__ import annotations

from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.scatmech import scatmech_table, write_scatmech


def write_scatmech_file(brdf: Brdf, path: Path) -> None:
    """An isotropic expansion of f without lobes.

    Raises:
        InputError: the format cannot hold this BRDF.
    """
    if len(brdf.channels) != 1:
        raise InputError(
            "--format scatmech", f"holds one channel; choose one of {', '.join(brdf.channels)} with --channel"
        )
    write_scatmech(path, scatmech_table(brdf))
