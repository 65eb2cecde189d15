"""The battery of hard cases as scenes: what the program must meet with a right answer, a wide interval or a refusal.

Every case changes one thing about a good set, so that what happens is that thing's doing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.scene import load_scene


@dataclass(frozen=True, slots=True)
class HardCase:
    """A scene, what must happen to it in one sentence, and the codes (docs/diagnoses.md) of which one tells of its
    fault."""

    name: str
    scene: Scene
    must: str
    telling: tuple[str, ...] = ()


IN_INTERVAL = "the error lies within the stated interval, or the set is refused"
ACCURATE = "the fit is as good as that of the plain set, and within its stated interval"
NAMED = "the bad photo is named and the error lies within the stated interval, or the set is refused"
TOLD = "the fault is told, or the error lies within the stated interval, or the set is refused"
PLAIN = "plain"  # nothing is wrong with it


def hard_names() -> tuple[str, ...]:
    return tuple(CASES)


def hard_case(name: str) -> HardCase:
    """One case of the battery; KeyError for a name that :func:`hard_names` does not list."""
    must, make, *telling = CASES[name]
    return HardCase(name, replace(make(), name=name), must, tuple(telling))


def satin(base: str = "example", **changes: object) -> Scene:
    """A good set, with fields of its parts replaced (``lamp={"count": 1}``); edges a little coarser, to save time."""
    good = changed(load_scene(base), camera={"calibration": 4}, render={"near": 2, "edge": 4})
    return changed(good, **changes)


def changed(scene: Scene, **changes: Any) -> Scene:
    """``scene`` with each named part's fields replaced, or the part itself where it is no dict."""
    parts: dict[str, Any] = {
        key: replace(getattr(scene, key), **value) if isinstance(value, dict) and key != "brdf" else value
        for key, value in changes.items()
    }
    return replace(scene, **parts)


def shiny(model: str, level: float = 0.55, brackets: tuple[float, ...] = (), **parameters: object) -> Scene:
    return satin(brdf={"model": model, **parameters}, sensor={"level": level, "brackets": brackets})


def wrong_patch() -> Scene:
    """What is said to be a 90 % white returns 55 %."""
    scene = satin()
    patch = replace(scene.white_patch[0], true_reflectance=(0.55,))
    return replace(scene, white_patch=(patch,))


def mislabelled() -> Scene:
    """One photo bears another's light, in a set whose lights are given."""
    return satin(lamp={"given": True}, fault={"mislabelled": ((2, 9),)})


def tiny() -> Scene:
    """A ball of 60 pixels across."""
    return satin(sample={"radius": 12.5, "center": (90.0, 70.0, 12.5)}, camera={"focal": 1500.0})


def grazing() -> Scene:
    """A flat sample under light at 85 to 89 degrees from its normal."""
    satin_plane = satin("oren-nayar-plane", brdf=load_scene("example").brdf)
    return changed(satin_plane, lamp={"elevation": (1.0, 5.0), "count": 16}, sensor={"level": 4.0})


def strong_lens() -> Scene:
    """A wide lens near by, whose barrel moves a corner of the picture by a tenth of its width."""
    barrel = (-0.45, 0.25, 0.002, -0.001, -0.05)
    return satin(camera={"distortion": barrel, "focal": 700.0, "distance": (340.0, 340.0)})


def black() -> Scene:
    matte = shiny("lambert", albedo=[0.02, 0.02, 0.02])
    return changed(matte, sensor={"bits": 8, "encoding": "srgb"})


# name: what must happen, the scene, codes of which one tells of the fault
CASES: dict[str, tuple[Any, ...]] = {
    PLAIN: (IN_INTERVAL, satin),
    "one-light": (IN_INTERVAL, lambda: satin(lamp={"count": 1, "elevation": (60.0, 60.0)})),
    "one-plane": (IN_INTERVAL, lambda: satin(lamp={"spread": "plane"})),
    "third-missing": (IN_INTERVAL, lambda: satin(fault={"missing": (1, 4, 7, 10)})),
    "grazing-light": (IN_INTERVAL, grazing),
    "near-mirror": (
        IN_INTERVAL,
        lambda: shiny("ggx-conductor", 0.3, (0.02, 0.2, 1.0), roughness=0.05, f0=[0.9, 0.85, 0.8]),
    ),
    # a peak of six degrees that no photo looks into
    "retro-reflector": (IN_INTERVAL, lambda: shiny("retro-reflector", retro=0.3, power=200.0)),
    "minnaert-0.3": (IN_INTERVAL, lambda: shiny("minnaert", albedo=[0.3, 0.3, 0.3], k=0.3)),
    "black-8-bit": (IN_INTERVAL, black),
    "saturated-highlights": (
        IN_INTERVAL,
        lambda: shiny("plastic", 1.2, albedo=[0.5, 0.4, 0.3], roughness=0.15),
    ),
    "strong-lens": (ACCURATE, strong_lens),
    "tiny-sample": (IN_INTERVAL, tiny),
    "noise-times-ten": (
        IN_INTERVAL,
        lambda: satin(sensor={"gain_electrons": 200.0, "read_noise_electrons": 0.5}),
    ),
    "wrong-patch": (
        TOLD,
        wrong_patch,
        "patch-not-believed",
        "patch-and-paper-scatter",
        "patches-contradict",
        "patches-uneven",
        "physics-contradicted",
    ),
    "two-lamps": (NAMED, lambda: satin(fault={"two_lamps": (5,)})),
    "moved-sample": (
        TOLD,
        lambda: satin(fault={"moved_after": 5, "moved_by": (3.0, -2.0, 0.0)}),
        "sample-moved",
        "sample-not-believed",
        "displaced-ball",
        "photos-contradict",
    ),
    "mislabelled": (NAMED, mislabelled),
}
