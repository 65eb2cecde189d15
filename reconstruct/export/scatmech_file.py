"""SCATMECH's coefficient file for its ``ZernikeExpansion`` BRDF: one channel."""

from __future__ import annotations

from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.scatmech import scatmech_table, write_scatmech
from photogonio.reconstruct.export.modes_file import loss_in_words, without_added_light
from photogonio.reconstruct.represent.developed import developed


def write_scatmech_file(brdf: Brdf, path: Path, order: int | None = None) -> str | None:
    """An isotropic expansion of f; lobes are developed in modes up to ``order``, and what is lost is said.

    Raises:
        InputError: the format cannot hold this BRDF.
    """
    if len(brdf.channels) != 1:
        raise InputError(
            "--format scatmech", f"holds one channel; choose one of {', '.join(brdf.channels)} with --channel"
        )
    if brdf.turning:
        raise InputError(
            "--format scatmech", "holds isotropic BRDFs only; this one changes as the sample turns"
        )
    if brdf.lobes or order is not None:
        found = developed(brdf, order, alone=True)
        kept, loss = without_added_light(brdf, found)
        write_scatmech(path, scatmech_table(kept))
        return loss_in_words(loss, brdf.channels, kept.order)
    write_scatmech(path, scatmech_table(brdf))
    return None
