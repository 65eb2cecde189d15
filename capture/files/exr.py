"""Which channels of an OpenEXR file are the photo: not its depth, normals and masks.

Names are as OpenEXR's technical introduction has them: ``layer.R``; without a layer the picture itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import OpenImageIO as oiio

COLOURS = ("R", "G", "B", "X", "Y", "Z")  # in this order, and before all others
CHROMA = {"RY", "BY"}  # luminance and chroma, the latter of fewer pixels
ASIDE = {"A", "AR", "AG", "AB", "Z", "ZBack", "ZFront", "id", "ID", "mask", "depth", "U", "V"}
ASIDE_LAYERS = {
    "n", "p", "z", "uv", "normal", "normals", "position", "depth", "albedo", "motion", "vector", "velocity", "forward",
    "mist",
}  # fmt: skip


def picture_of(file: oiio.ImageInput) -> tuple[int, tuple[int, ...]]:
    """The part that holds the photo, and its channels in it. Raises ValueError, saying why, if that is not clear."""
    found = []
    part = 0
    while file.seek_subimage(part, 0):
        spec = file.spec()
        if spec.get_int_attribute("oiio:deep") or spec.deep:
            raise ValueError("holds deep pixels; expected flat ones")
        for layer, channels in layers_of(spec.channelnames).items():
            found.append((part, spec.get_string_attribute("oiio:subimagename"), layer, channels))
        part += 1
    best = [one for one in found if not one[2]]
    best = best or [one for one in found if one[2].rpartition(".")[2].lower() not in ASIDE_LAYERS]
    if not best:
        raise ValueError("holds no channel of light, only depth, alpha or the like")
    if len(best) > 1:
        names = ", ".join(".".join(filter(None, one[1:3])) or f"part {one[0]}" for one in best)
        raise ValueError(f"holds several pictures ({names}); expected one")
    return best[0][0], best[0][3]


def layers_of(names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """The channels of light of each layer ("" without one), R, G, B first."""
    layers: dict[str, dict[str, int]] = {}
    for k, name in enumerate(names):
        layer, _, channel = name.rpartition(".")
        layers.setdefault(layer, {})[channel] = k
    found = {}
    for layer, channels in layers.items():
        if CHROMA & channels.keys():
            raise ValueError(
                "holds luminance and chroma of fewer pixels; expected R, G, B or more channels of light"
            )
        tristimulus = {"X", "Y", "Z"} <= channels.keys()
        kept = [name for name in channels if name not in ASIDE or (tristimulus and name == "Z")]
        kept.sort(key=lambda name: COLOURS.index(name) if name in COLOURS else len(COLOURS))
        if kept:
            found[layer] = tuple(channels[name] for name in kept)
    return found
