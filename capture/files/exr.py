"""Which channels of an OpenEXR file are the photo: not its depth, normals and masks.

Names are as OpenEXR's technical introduction has them: ``layer.R``; without a layer the picture itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import OpenImageIO as oiio

from photogonio.capture.containers.tone import LINEAR, TRANSFERS, Curve, Tone

LINEAR_KINDS = {"", "lin", "data", "unknown"}
GAMMAS = {"g18": 1.8, "g22": 2.2, "g24": 2.4, "g26": 2.6}
# in this order, and before all others, in capitals or not
COLOURS = {
    name: k
    for k, names in enumerate((("r", "red"), ("g", "green"), ("b", "blue"), ("x",), ("y",), ("z",)))
    for name in names
}
CHROMA = {"RY", "BY"}  # luminance and chroma, the latter of fewer pixels
ASIDE = {
    "a", "alpha", "ar", "ag", "ab", "z", "zback", "zfront", "depth", "zdepth", "dist", "distance", "id", "objectid",
    "materialid", "mask", "matte", "u", "v", "w", "uv", "nx", "ny", "nz", "n", "px", "py", "pz", "p", "normal",
    "position", "velocity", "motion", "mist", "coverage", "samplecount", "samples", "variance",
}  # fmt: skip
ASIDE_LAYERS = {
    "n", "p", "z", "uv", "normal", "normals", "position", "depth", "albedo", "motion", "vector", "velocity", "forward",
    "mist", "indexob", "indexma", "pworld", "pref", "nn", "cryptoobject", "cryptomaterial", "cryptoasset",
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
    best = best or [one for one in found if layer_name(one[2]) not in ASIDE_LAYERS]
    if not best:
        raise ValueError("holds no channel of light, only depth, alpha or the like")
    if len(best) > 1:
        names = ", ".join(".".join(filter(None, one[1:3])) or f"part {one[0]}" for one in best)
        raise ValueError(f"holds several pictures ({names}); expected one")
    return best[0][0], best[0][3]


def tone_of(spec: oiio.ImageSpec) -> Tone:
    """Linear, as the format has it, unless the file names another colour space (colorInteropID of OpenEXR 3.4).

    Raises ValueError for a name that says nothing known here.
    """
    name = spec.get_string_attribute("colorInteropID")
    kind = name.partition("_")[0].lower()
    if kind in LINEAR_KINDS:
        return Tone((LINEAR,), "OpenEXR")
    source = f'colorInteropID "{name[:60]}"'
    if kind in TRANSFERS:
        return Tone((Curve(kind),), source)
    if kind in GAMMAS:
        return Tone((Curve("gamma", (GAMMAS[kind],)),), source)
    raise ValueError(f"{source} is no name that is known")


def layer_name(layer: str) -> str:
    """The last part of a layer's name, without case and number: ``ViewLayer.CryptoObject00`` is ``cryptoobject``."""
    return layer.rpartition(".")[2].lower().rstrip("0123456789")


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
        small = [name.lower() for name in channels]
        tristimulus = {"x", "y", "z"} <= set(small)
        kept = [name for name in channels if name.lower() not in ASIDE or (tristimulus and name in "zZ")]
        kept.sort(key=lambda name: COLOURS.get(name.lower(), len(COLOURS)))
        if kept:
            found[layer] = tuple(channels[name] for name in kept)
    return found
