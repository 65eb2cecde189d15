"""Set-ups drawn at random, and what photos of them would show: shared by tests and benchmarks.

Camera, lens, poses, lamps, a sample ball and mirror balls that stand beside where the manifest says, a patch. Corners,
highlights, limbs, paper and patch are drawn from the geometry with noise and with errors of the size that path-traced
photos have, or that calibration allows for; nothing is rendered.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.limb import Limb
from photogonio.calib.detect.masks import fill
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.paper import PaperSamples, covered, draw_print, spread_of
from photogonio.calib.detect.paper_reading import PaperReading, PatchSamples
from photogonio.calib.geometry.board import Corners, board_points, board_size
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.calib.geometry.mirror import mirrored_point
from photogonio.calib.geometry.visibility import behind_ball, direct
from photogonio.calib.shading.interreflection import diffuse_bounce, glossy_bounce, polished_bounce
from photogonio.calib.shading.kernel import light_on_board
from photogonio.calib.shading.model import Ball, ShadingScene, lit
from photogonio.capture.photoset import (
    CameraEntry,
    CharucoBoard,
    MirrorBall,
    Photo,
    PhotoSet,
    Sphere,
    WhitePatch,
)
from photogonio.capture.radiance import RadianceImage

SIZE = (800, 600)
BOARD = CharucoBoard("DICT_5X5_250", squares=(9, 7), square_length=20.0, marker_length=15.0)
MIDDLE = np.append(board_size(BOARD) / 2, 0.0)
SAMPLE = Sphere(np.array([90.0, 70.0, 25.0]), 25.0)
BALLS = (MirrorBall(np.array([10.0, 10, 8]), 8.0), MirrorBall(np.array([170.0, 130, 8]), 8.0))
PATCH = WhitePatch(np.array([[150.0, 10], [170, 10], [170, 30], [150, 30]]), 0.3, (0.9,))
PAPER, BLACK = 0.8, 0.05  # reflectances of paper and print
# least and most of what the sample throws onto the board, diffusely and glossily, as shading counts it; of the angle by
# which its roughness spreads the gloss, radians, which shading does not know; of what mirror balls throw
THROWN = np.array([[0.05, 0.0, 0.0, 0.3], [0.9, 2.0, 0.4, 0.95]])
EDGE = 0.04  # of the light beside a shadow: what its edge misses in path-traced photos, 4 to 6 % with their noise
AMISS = 0.15  # relative, over half the board: what balls throw, beside what is supposed of it
TILT = 0.001  # relative, over half the board: how even paper and lens are
STANDS = 0.002  # of its radius: how well a ball touches the board, whose paper is not quite flat
BLUR = 0.5  # pixels squared: variance in the picture of what a sample of the paper gathers
UNEVEN = 0.002  # relative, of patch and paper as a whole from view to view: dirt, light from elsewhere
ACROSS = 70  # paper samples along the board


@dataclass(frozen=True, slots=True)
class World:
    """One set-up as it is."""

    camera: Camera
    boards: tuple[Pose, ...]  # of the calibration photos
    views: tuple[Pose, ...]
    lamps: np.ndarray  # (v, 3)
    strengths: np.ndarray  # (v,) radiance times length squared
    sample: Ball
    balls: tuple[Ball, ...]
    lamp_radius: float
    corner_noise: float  # pixels
    thrown: np.ndarray  # (4,) as of THROWN
    amiss: np.ndarray  # (v, 2) along the board
    tilt: np.ndarray  # (v, 2) likewise, of paper and lens

    @property
    def table(self) -> np.ndarray:
        """(k, 4) centres and radii of all balls, the sample last."""
        return np.array([[*b.center, b.radius] for b in (*self.balls, self.sample)])


def draw_world(rng: np.random.Generator, *, fixed: bool, views: int, boards: int = 8) -> World:
    """A set-up as a person might build it, 0.35 to 0.65 m from lamp to board."""
    focal = rng.uniform(1000, 1300)
    matrix = np.array([[focal, 0, 0], [0, focal * (1 + 5e-4 * rng.normal()), 0], [0, 0, 1]])
    matrix[:2, 2] = (np.array(SIZE) - 1) / 2 + 5 * rng.normal(size=2)
    lens = np.array([rng.uniform(-0.2, 0.1), rng.uniform(-0.1, 0.1), *(5e-4 * rng.normal(size=2)), 0.0])
    around = 2 * np.pi * (np.arange(boards) + rng.uniform(0, 1, boards)) / boards
    first = [_look(focal * 0.4, t, rng.uniform(5, 45), rng) for t in around]
    stand = _look(focal * 0.45, rng.uniform(0, 2 * np.pi), rng.uniform(25, 50), rng)
    poses = [
        stand if fixed else _look(focal * 0.45, t, rng.uniform(5, 55), rng)
        for t in rng.uniform(0, 2 * np.pi, views)
    ]
    high, turn = np.radians(rng.uniform(20, 80, views)), rng.uniform(0, 2 * np.pi, views)
    toward = np.column_stack([np.cos(high) * np.cos(turn), np.cos(high) * np.sin(turn), np.sin(high)])
    aside = rng.spawn(1)[0]  # what else differs from set to set, without a change in all else that is drawn
    return World(
        Camera(matrix, lens, SIZE),
        tuple(first),
        tuple(poses),
        MIDDLE + rng.uniform(350, 650, (views, 1)) * toward,
        1e5 * (np.ones(views) if rng.uniform() < 0.5 else rng.uniform(0.7, 1.4, views)),
        _beside(rng, aside, SAMPLE, 0.01, 0.002),
        tuple(_beside(rng, aside, b, 0.02, 0.003) for b in BALLS),
        float(rng.uniform(3, 9)),
        float(rng.uniform(0.02, 0.1)),
        aside.uniform(*THROWN),
        AMISS * aside.normal(size=(views, 2)),
        TILT * aside.normal(size=(views, 2)),
    )


def _beside(
    rng: np.random.Generator,
    aside: np.random.Generator,
    thing: Sphere | MirrorBall,
    shift: float,
    size: float,
) -> Ball:
    """A ball that stands on the board near where it should, shift and size of its radius."""
    radius = thing.radius * (1 + size * rng.normal())
    flat = thing.center[:2] + shift * thing.radius * rng.normal(size=2)
    return Ball(np.append(flat, radius + STANDS * thing.radius * aside.normal()), radius)


def _look(distance: float, turn: float, tilt: float, rng: np.random.Generator) -> Pose:
    """A camera ``tilt`` degrees from above, ``distance`` from a place near the board's middle, rolled at random."""
    slant = np.radians(tilt)
    away = np.array([np.sin(slant) * np.cos(turn), np.sin(slant) * np.sin(turn), np.cos(slant)])
    eye = MIDDLE + distance * away
    axis = MIDDLE + np.append(8 * rng.normal(size=2), 0.0) - eye
    axis /= np.linalg.norm(axis)
    right = np.cross(axis, [-np.sin(turn), np.cos(turn), 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(axis, right), axis])
    spin = Pose.from_rodrigues(np.array([0, 0, rng.uniform(-np.pi, np.pi)]), np.zeros(3)).rotation @ rotation
    return Pose(spin, -spin @ eye)


def photoset_of(world: World, *, fixed: bool) -> PhotoSet:
    photos = [Photo(f"c{k}", "calibration") for k in range(len(world.boards))]
    photos += [Photo(f"s{k}", "sample") for k in range(len(world.views))]
    return PhotoSet(
        Path("."), "drawn", "mm", SAMPLE, "auto", tuple(photos), BOARD, BALLS, (PATCH,), camera=CameraEntry(fixed=fixed)
    )  # fmt: skip


def draw_corners(world: World, pose: Pose, rng: np.random.Generator, *, things: bool) -> Corners:
    """The board's corners in one photo with noise; those behind balls and patch are not seen."""
    points = board_points(BOARD)
    pixels = world.camera.project(pose, points)
    seen = (pixels > 4).all(1) & (pixels < np.array(SIZE) - 5).all(1)
    if things:
        seen &= ~covered(points, pose, SAMPLE, BALLS, (PATCH,), 2.0)
    pixels = pixels[seen] + world.corner_noise * rng.normal(size=(int(seen.sum()), 2))
    stated = np.full(len(pixels), 0.02)  # as the detector says; what they show is found out
    return Corners(np.flatnonzero(seen), points[seen], pixels, stated, np.zeros(0, int), np.zeros((0, 4, 2)))


def observe(
    world: World, observation: Observation, number: int, bias: float, rng: np.random.Generator, *, paper: bool
) -> None:
    """Fill in what one photo shows beside the corners."""
    pose, lamp = world.views[number], world.lamps[number]
    for k, ball in enumerate(world.balls):
        point = mirrored_point(ball.center, ball.radius, pose.center, lamp)
        sigma = float(rng.uniform(0.08, 0.2))
        pixel = world.camera.project(pose, point[None])[0] + sigma * rng.normal(size=2)
        observation.highlights.append(Highlight(k, pixel, sigma, 1.0, 4.0, False))
    observation.limb = _limb(world, pose, bias, rng)
    if paper:
        observation.reading = draw_paper(world, number, rng)


def _limb(world: World, pose: Pose, bias: float, rng: np.random.Generator) -> Limb:
    edge = outline(world.camera, pose, world.sample.center, world.sample.radius, 72)
    wider = outline(world.camera, pose, world.sample.center, 1.02 * world.sample.radius, 72)
    normal = (wider - edge) / np.linalg.norm(wider - edge, axis=1, keepdims=True)
    sigma = np.full(len(edge), 0.5)
    off = sigma * rng.normal(size=len(edge)) - bias
    return Limb(edge + off[:, None] * normal, sigma)


def scene_of(world: World) -> ShadingScene:
    return ShadingScene(world.balls, world.sample, world.lamp_radius, BLACK / PAPER, 0.0)


def thrown_light(world: World, points: np.ndarray, lamp: np.ndarray) -> np.ndarray:
    """Irradiance (n,) at board points (n, 3) by what balls throw of a unit lamp's light. A rough gloss throws what a
    mirror does of lamps about it."""
    diffuse, glossy, rough, polished = world.thrown
    ball, toward = world.sample, lamp - world.sample.center
    aside = np.tan(rough) * np.linalg.norm(toward) * np.linalg.svd(toward[None])[2][1:]
    turned = toward + np.vstack([np.zeros(3), aside, -aside])
    turned *= (np.linalg.norm(toward) / np.linalg.norm(turned, axis=1))[:, None]
    gloss = np.mean(
        [glossy_bounce(points, ball.center + t, ball.center, ball.radius) for t in turned], axis=0
    )
    return (
        diffuse * diffuse_bounce(points, lamp, ball.center, ball.radius)
        + glossy * gloss
        + polished * polished_bounce(points, lamp, world.table[:-1])
    )


def draw_paper(world: World, number: int, rng: np.random.Generator) -> PaperReading:
    """The paper's radiance in one photo: direct light, shadows as lens and pixels blur them, what balls throw onto it,
    unevenness of paper, lens and squares."""
    size = board_size(BOARD)
    step = size.max() / ACROSS
    x, y = np.meshgrid(np.arange(step / 2, size[0], step), np.arange(step / 2, size[1], step))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    white, clear = draw_print(BOARD).at(points[:, :2])
    kept = (clear > 0.8) & ~covered(points, world.views[number], SAMPLE, BALLS, (PATCH,), 2.0)
    for ball in world.balls:
        kept &= np.hypot(*(points[:, :2] - ball.center[:2]).T) > 3 * ball.radius
    points, white = points[kept], white[kept]
    lamp, across = world.lamps[number], np.ascontiguousarray((2 * points[:, :2] / size - 1).T)
    bare, shaded, tilt = _on_board(world, number, points, across)
    edge = np.where((shaded > 0.01 * bare) & (shaded < 0.99 * bare), EDGE * bare, 0.0)
    level = shaded * tilt + edge * rng.normal(size=len(bare))
    level += thrown_light(world, points, lamp) * (1 + world.amiss[number] @ across)
    level *= np.where(white, PAPER, BLACK) * world.strengths[number] / np.pi
    square = (points[:, 0] // 20 + 9 * (points[:, 1] // 20)).astype(int)
    level *= (1 + 0.002 * rng.normal(size=63))[square] * (1 + UNEVEN * rng.normal())
    noise = (0.01 * level) ** 2
    level = level + np.sqrt(noise) * rng.normal(size=len(level))
    spread = spread_of(world.camera, world.views[number], points, BLUR)
    aside = world.camera.aside(world.camera.project(world.views[number], points))
    samples = PaperSamples(points, white, level[:, None], noise[:, None], square, spread, aside)
    return PaperReading(samples, level, noise)


def _on_board(world: World, number: int, points: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Direct light, what shadows leave of it, and its tilt, (3, n)."""
    ones, result, nowhere = np.ones(len(points)), np.empty((4, len(points))), np.zeros(3)
    spread = spread_of(world.camera, world.views[number], points, BLUR)
    light_on_board(
        points, ones, spread, across, world.lamps[number], 1.0, 1.0, world.lamp_radius, 0.0, nowhere,
        world.tilt[number], 0.0, world.table, result,
    )  # fmt: skip
    return result[1:]


def draw_patch(
    world: World, number: int, rng: np.random.Generator, *, bounced: bool = False
) -> RadianceImage:
    """A picture that holds nothing but the white patch, with what balls throw onto it where shading can tell."""
    pose, lamp = world.views[number], world.lamps[number]
    corners = world.camera.project(pose, np.column_stack([PATCH.outline, np.full(4, PATCH.height)]))
    mask = np.zeros(SIZE[::-1], np.uint8)
    fill(mask, corners)
    y, x = np.nonzero(mask)
    value = np.zeros((*mask.shape, 1), np.float32)
    if len(x):
        rays = world.camera.world_rays(pose, np.column_stack([x, y]).astype(float))
        points = pose.center + ((PATCH.height - pose.center[2]) / rays[:, 2])[:, None] * rays
        offset = lamp - points
        shape = offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3 * lit(points, lamp, scene_of(world))
        if bounced:
            shape += thrown_light(world, points, lamp)
        for ball in (*world.balls, world.sample):
            shape[behind_ball(points, pose.center, ball.center, ball.radius)] = 0.0
        level = shape * world.strengths[number] * PATCH.reflectance[0] / np.pi * (1 + UNEVEN * rng.normal())
        value[y, x, 0] = level * (1 + 0.005 * rng.normal(size=len(level)))
    clear = np.ones(mask.shape, bool)
    return RadianceImage(value, np.maximum(0.005 * value, 1e-6) ** 2, clear, ~clear)


def strip_of(
    place: np.ndarray, factor: float, rng: np.random.Generator, noise: float = 0.003
) -> PatchSamples:
    """A strip of white beside the board's lower edge under a lamp of unit strength at ``place`` (3,), ``factor`` times
    as bright as paper of reflectance 1 would be."""
    x, y = (side.ravel() for side in np.meshgrid(np.arange(10.5, 170.0, 2.0), np.arange(-12.0, -3.0, 2.0)))
    points = np.column_stack([x, y, np.zeros(len(x))])
    level = factor * direct(points, place)
    sigma = noise * level
    level = level + sigma * rng.normal(size=len(x))
    spread = np.tile([0.2, 0.0, 0.2], (len(x), 1))
    return PatchSamples(
        points, level, sigma**2, (x // 20).astype(int), spread, 0.1 * x / 170, np.full(len(x), 0.8)
    )
