"""The battery of hard cases as scenes: what the program must meet with a right answer, a wide interval or a refusal.

Every case changes one thing about a good set, so that what happens is that thing's doing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from synthetic.scene import Scene, load_scene


@dataclass(frozen=True, slots=True)
class HardCase:
    """A scene and, in one sentence, what must happen to it."""

    name: str
    scene: Scene
    must: str


IN_INTERVAL = "the error lies within the stated interval, or the set is refused"
ACCURATE = "the fit is as good as that of the plain set"
NAMED = "the bad photo is named and left out, or the set is refused"
WARNED = "the fault is named, or the error lies within the stated interval"


def hard_names() -> tuple[str, ...]:
    return tuple(CASES)


def hard_case(name: str) -> HardCase:
    """One case of the battery; KeyError for a name that :func:`hard_names` does not list."""
    must, make = CASES[name]
    return HardCase(name, replace(make(), name=name), must)


def satin(**changes: object) -> Scene:
    """The example scene, with fields of its parts replaced: ``lamp={"count": 1}``."""
    return changed(load_scene("example"), **changes)


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
    scene = satin()
    patch = replace(scene.white_patch[0], true_reflectance=(0.55,))
    return replace(scene, white_patch=(patch,))


def mislabelled() -> Scene:
    """Two photos bear each other's light, in a set whose lights are given."""
    return satin(lamp={"given": True}, fault={"swapped": ((2, 9),)})


def tiny() -> Scene:
    """A ball of 60 pixels across."""
    return satin(sample={"radius": 12.5, "center": (90.0, 70.0, 12.5)}, camera={"focal": 1500.0})


def grazing() -> Scene:
    """A flat sample under light at 85 to 89 degrees from its normal."""
    scene = replace(load_scene("oren-nayar-plane"), brdf=load_scene("example").brdf)
    return changed(scene, lamp={"elevation": (1.0, 5.0), "count": 16}, sensor={"level": 4.0})


CASES: dict[str, tuple[str, Callable[[], Scene]]] = {
    "one-light": (IN_INTERVAL, lambda: satin(lamp={"count": 1, "elevation": (60.0, 60.0)})),
    "one-plane": (IN_INTERVAL, lambda: satin(lamp={"spread": "plane"})),
    "third-missing": (IN_INTERVAL, lambda: satin(fault={"missing": (1, 4, 7, 10)})),
    "grazing-light": (IN_INTERVAL, grazing),
    "near-mirror": (
        IN_INTERVAL,
        lambda: shiny("ggx-conductor", 0.3, (0.02, 0.2, 1.0), roughness=0.05, f0=[0.9, 0.85, 0.8]),
    ),
    "retro-reflector": (IN_INTERVAL, lambda: shiny("retro-reflector", retro=0.3, power=200.0)),
    "minnaert-0.3": (IN_INTERVAL, lambda: shiny("minnaert", albedo=[0.3, 0.3, 0.3], k=0.3)),
    "black-8-bit": (
        IN_INTERVAL,
        lambda: changed(shiny("lambert", albedo=[0.02, 0.02, 0.02]), sensor={"bits": 8, "encoding": "srgb"}),
    ),
    "saturated-highlights": (
        IN_INTERVAL,
        lambda: shiny("plastic", 1.2, albedo=[0.5, 0.4, 0.3], roughness=0.15),
    ),
    "strong-lens": (
        ACCURATE,
        lambda: satin(
            camera={
                "distortion": (-0.45, 0.25, 0.002, -0.001, -0.05),
                "focal": 700.0,
                "distance": (340.0, 340.0),
            }
        ),
    ),
    "tiny-sample": (IN_INTERVAL, tiny),
    "noise-times-ten": (
        IN_INTERVAL,
        lambda: satin(sensor={"gain_electrons": 200.0, "read_noise_electrons": 0.5}),
    ),
    "wrong-patch": (WARNED, wrong_patch),
    "two-lamps": (NAMED, lambda: satin(fault={"two_lamps": (5,)})),
    "moved-sample": (WARNED, lambda: satin(fault={"moved_after": 5, "moved_by": (3.0, -2.0, 0.0)})),
    "mislabelled": (NAMED, mislabelled),
}
