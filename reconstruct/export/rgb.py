"""Which of a BRDF's channels are red, green and blue."""

from __future__ import annotations

from photogonio.reconstruct.brdf.merl import CHANNELS


def rgb_order(channels: tuple[str, ...]) -> list[int] | None:
    """Places of R, G and B among the channels; None if they are not exactly these three."""
    return [channels.index(name) for name in CHANNELS] if set(channels) == set(CHANNELS) else None
