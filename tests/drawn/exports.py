"""BRDFs to export, and pairs of directions to ask their files at."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.basis import isotropic_modes


def satin(channels: tuple[str, ...] = ("R", "G", "B"), *, lobes: bool = True) -> Brdf:
    c = len(channels)
    modes = isotropic_modes(2)
    coefficients = np.zeros((len(modes), c))
    coefficients[0] = np.linspace(2.0, 1.0, c)
    coefficients[1] = 0.1
    lobe = Lobe(0.3, np.full(c, 0.04), np.ones(c))
    return Brdf(2, channels, modes, coefficients, np.zeros_like(coefficients), lobes=(lobe,) if lobes else ())


def random_pairs(count: int, below: float = 80.0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(3)
    theta = np.arccos(rng.uniform(np.cos(np.radians(below)), 1, (2, count)))
    phi = rng.uniform(0, 2 * np.pi, (2, count))
    return unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])


def coated(roughness: float = 0.4) -> Brdf:
    """A coat over a diffuse ground, which version 1 of the file does not know."""
    one = np.ones(1)
    coat = Lobe(roughness, 0.04 * one, one, "coat", fresnel="dielectric", ground=0.3 * one)
    return Brdf(0, ("Y",), isotropic_modes(0), np.full((1, 1), 0.1), np.zeros((1, 1)), lobes=(coat,))


ALBEDO = np.array([0.6, 0.3, 0.1])


def matte() -> Brdf:
    return Brdf(0, ("R", "G", "B"), np.array([[0, 0, 0]]), 2 * ALBEDO[None], np.zeros((1, 3)))


def metal(roughness=0.25) -> Brdf:
    """GGX with Schlick's reflectance, as engines have it."""
    lobe = Lobe(roughness, np.array([0.9, 0.7, 0.4]), np.ones(3))
    return Brdf(0, ("R", "G", "B"), np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)), lobes=(lobe,))


def plastic() -> Brdf:
    """A dielectric's coat over a ground, which OpenPBR has but for what the ground sees from the light."""
    lobe = Lobe(
        0.2, np.full(3, 0.04), np.ones(3), "coat", fresnel="dielectric", ground=np.array([0.5, 0.3, 0.1])
    )
    return Brdf(0, ("R", "G", "B"), np.zeros((0, 3), int), np.zeros((0, 3)), np.zeros((0, 3)), lobes=(lobe,))


def plain(albedo=0.5, lobes=()) -> Brdf:
    return Brdf(
        0,
        ("R", "G", "B"),
        np.array([[0, 0, 0]]),
        np.full((1, 3), 2 * albedo),  # the first mode is 1 / (2 pi)
        np.zeros((1, 3)),
        lobes=lobes,
    )


def rms_between(found: Brdf, given: Brdf) -> float:
    """Rms of the difference over that of f, cosine weighted, both angles below 70 degrees, at random pairs."""
    rng = np.random.default_rng(5)
    theta = np.arcsin(np.sin(np.radians(70.0)) * np.sqrt(rng.uniform(size=(2, 20_000))))
    dphi = rng.uniform(0.0, np.pi, 20_000)
    f, g = (one.evaluate(theta[0], 0.0, theta[1], dphi) for one in (found, given))
    return float(np.sqrt(np.mean((f - g) ** 2) / np.mean(g**2)))


def over_ground(lobe: Lobe, channels=("R", "G", "B")) -> Brdf:
    count = len(channels)
    return Brdf(
        0, channels, np.array([[0, 0, 0]]), np.full((1, count), 0.4), np.zeros((1, count)), lobes=(lobe,)
    )


def gloss(roughness, count=3, **more) -> Lobe:
    return Lobe(roughness, np.linspace(0.04, 0.06, count), np.ones(count), **more)
