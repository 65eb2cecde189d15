"""The room's front door: from a photo set to where everything was."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from photogonio.calib.adjust.alternate import Settled, settle, start_sample, start_scene
from photogonio.calib.adjust.bundle import CameraModel, block_pose, pose_block
from photogonio.calib.adjust.flat_sample import PlaneMove, lying
from photogonio.calib.adjust.lamps import block_name, place_in_world, start_lamps
from photogonio.calib.camera_poses import (
    as_printed,
    check_camera,
    find_camera,
    find_poses,
    look_at_all,
    scale_corners,
)
from photogonio.calib.detect.observation import (
    FIXED_POSE,
    POSE,
    Keep,
    Observation,
    Posed,
    channel_names,
    hand_over,
    in_memory,
    start_over,
)
from photogonio.calib.detect.observe import observe
from photogonio.calib.detect.photo_reader import Looks, Progress, Reader, ReadLevel, ReadPart, ReadRadiance
from photogonio.calib.diagnose.allowances import NO_FALLOFF, Settle, settle_allowing
from photogonio.calib.diagnose.ambient_light import (
    Beside,
    ambient_irradiance,
    expect,
    light_beside,
    note_beside,
)
from photogonio.calib.diagnose.displaced_ball import ball_elsewhere, note_ball, shows_limb
from photogonio.calib.diagnose.ghosting import tell_ghosts
from photogonio.calib.diagnose.glossy_print import shining, white_alone
from photogonio.calib.diagnose.lamp_beam import Beam, note_beam
from photogonio.calib.diagnose.moved_lamp import tell_shared_apart
from photogonio.calib.diagnose.outline_off_sample import cut_to_sample
from photogonio.calib.diagnose.thick_sample import clear_of_slab, is_thick
from photogonio.calib.diagnose.tone_curve import tone_doubt, tone_warning
from photogonio.calib.diagnose.unusable_photos import contradiction, denied_by_patch, washed_out
from photogonio.calib.diagnose.veiling_glare import (
    Veil,
    find_veils,
    lift,
    lifted,
    lifted_image,
    lifted_view,
    note_veil,
)
from photogonio.calib.diagnose.vignetting import brighten, brightened_image, doubted, note_falloff
from photogonio.calib.geometry.board import Corners, board_size
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.radiometry.patch import patches_box
from photogonio.calib.radiometry.readings import StrengthReadings, read_view
from photogonio.calib.radiometry.scale import tie
from photogonio.calib.remarks import Remarks, listed
from photogonio.calib.report.summary import (
    account,
    account_plane,
    believed,
    board_marks,
    marks,
    sample_in_picture,
)
from photogonio.calib.setup import BoardSetup, Falloff, Light, Setup, ViewSetup
from photogonio.calib.shading.initial import square_ratios, white_level
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST, MirrorBall, PhotoSet, Plane, Sphere

_FAR_OFF = 10.0  # board diagonals: a sample as far is told in another unit


def calibrate(
    photoset: PhotoSet,
    read_radiance: ReadRadiance,
    progress: Progress | None = None,
    *,
    read_part: ReadPart | None = None,
    read_level: ReadLevel | None = None,
    workers: int = 1,
    keep: Keep = in_memory,
    looks: Looks | None = None,
) -> Setup:
    """Camera, poses, lights, sample and irradiance of every sample view.

    ``read_part`` reads a region of a view, ``read_level`` its gray levels, at less cost; ``workers`` photos are in
    memory at once; ``keep`` sets aside what was read of a view's paper, some megabytes; ``looks`` keeps what a first
    look at each view found. Views that cannot be used are in ``left_out`` with the reason; InputError if none can.
    ``progress(label, done, total)`` is called after each photo.
    """
    tell = progress or (lambda label, done, total: None)
    reader, remarks = Reader(photoset, read_radiance, read_part, read_level, workers, keep, looks), Remarks()
    photos = look_at_all(photoset, reader, tell, remarks)
    photoset, photos = as_printed(photoset, reader, photos, remarks)
    camera, model, photos = find_camera(photoset, reader, photos, tell, remarks)
    boards, observations = find_poses(photoset, camera, photos, remarks)
    observations = _with_sample(photoset, camera, observations, remarks)
    scale_corners(camera, boards, observations)
    check_camera(photoset, camera, model, boards, observations, remarks)
    photoset = _observed(photoset, reader, camera, observations, tell, remarks)
    doubt = tone_doubt(photoset, camera, observations)
    if doubt is not None:
        remarks.tell("print-contradicts-encoding", tone_warning(photoset, doubt), **doubt.to_dict())
    observations, veils = usable(photoset, observations, remarks, reader.workers)
    lift(observations, veils)
    tell_shared_apart(photoset, reader, camera, observations, remarks)
    settle_for = partial(settled_from, photoset, reader, model, camera, boards, observations, tell)
    settled, beam, beside, falloff = settled_at_last(photoset, observations, settle_for)
    if falloff is not None and falloff.allowed:
        brighten(observations, falloff)
    views, scale = _views(photoset, reader, settled, observations, falloff, veils, remarks)
    if not views:
        raise InputError(photoset.folder / MANIFEST, "no sample photo can be used: " + remarks.reasons())
    ambient = ambient_irradiance(views, observations) if beside is not None and beside.told else None
    note_veil(veils, remarks)
    note_beside(beside, ambient, remarks)
    note_beam(settled, beam, remarks)
    note_falloff(falloff, remarks)
    account(photoset, settled, observations, remarks)
    kept = {view.name for view in views}
    tell_ghosts(
        reader, settled.camera, photoset.sample, [s for s in observations if s.view.name in kept], remarks
    )
    doubtful, common = doubted(photoset, settled, views, falloff)
    move = _plane_move(photoset, settled, observations)
    account_plane(photoset, move, remarks)
    return Setup(
        settled.camera,
        _sample(photoset, settled, move),
        doubtful,
        scale,
        channel_names(len(views[0].strength)),
        tuple(remarks.left_out),
        tuple(remarks.warnings),
        remarks.residuals,
        diagnoses=tuple(remarks.diagnoses),
        mirror_balls=_mirror_balls(photoset, settled),
        boards=tuple(_board(settled, *board) for board in boards),
        ambient=ambient,
        falloff=falloff,
        scale_error=_scale_error(common, beside, remarks),
    )


def _scale_error(lens: float, beside: Beside | None, remarks: Remarks) -> float:
    """Relative error that all strengths share: of lens, room, and patches that are unevenly lit."""
    room, uneven = 0.0 if beside is None else beside.doubt, remarks.residuals.get("uneven_patches_error", 0.0)
    return float(np.linalg.norm([lens, room, uneven]))


def _with_sample(
    photoset: PhotoSet, camera: Camera, observations: list[Observation], remarks: Remarks
) -> list[Observation]:
    """The observations that show the sample, and the probes; InputError if none shows it."""
    kept = []
    for observation in observations:
        if observation.probe or sample_in_picture(camera, observation.pose, photoset.sample):
            kept.append(observation)
        else:
            remarks.leave_out(
                observation.view.name, "the sample lies outside the picture", "sample-outside-picture"
            )
    if all(s.probe for s in kept):
        why = remarks.reasons() + _other_unit(photoset)
        raise InputError(photoset.folder / MANIFEST, "no sample photo can be used: " + why)
    return kept


def _other_unit(photoset: PhotoSet) -> str:
    """A hint, where the sample lies so far from the board that one of them may be told in another unit."""
    if photoset.board is None:
        return ""
    sample, size = photoset.sample, board_size(photoset.board)
    flat = sample.center[:2] if isinstance(sample, Sphere) else np.mean(sample.outline, axis=0)
    if np.linalg.norm(flat - size / 2) < _FAR_OFF * np.linalg.norm(size):
        return ""
    width, height = size
    return (
        f". It is told to be at [{flat[0]:g}, {flat[1]:g}], the board to be {width:g} x {height:g} large: all lengths "
        "must be in one unit"
    )


def _observed(
    photoset: PhotoSet,
    reader: Reader,
    camera: Camera,
    observations: list[Observation],
    tell: Progress,
    remarks: Remarks,
) -> PhotoSet:
    """Fill in what the observations show, with the sample where it is seen; the set with it there."""
    photoset = cut_to_sample(photoset, reader, camera, observations, remarks)
    observe(photoset, reader, camera, observations, photoset.mirror_balls, tell)
    found = ball_elsewhere(photoset, reader, camera, observations)
    if found is None:
        return photoset
    moved, before = replace(photoset, sample=found), [replace(s) for s in observations]
    observe(moved, reader, camera, observations, photoset.mirror_balls, tell)
    if shows_limb(observations):
        note_ball(photoset, found, remarks)
        return moved
    for observation, old in zip(observations, before, strict=True):
        for name in Observation.__slots__:
            setattr(observation, name, getattr(old, name))
    return photoset


def usable(
    photoset: PhotoSet, observations: list[Observation], remarks: Remarks, workers: int = 1
) -> tuple[list[Observation], dict[str, Veil]]:
    """Those in which a lamp was on and the print is sharp, of a print that shines its white alone, and what lies over
    their pictures; InputError if that is none of the sample."""
    papers = [s for s in observations if s.has_paper and not s.dark]
    # a veil makes black print an uneven share of the white, as shine does, but one that it explains
    veils = find_veils(((s.view.name, s.reading) for s in papers), workers)
    whites = {s.view.name: white_level(s.reading) for s in papers}
    shares = {s.view.name: square_ratios(lifted(s.reading, veils.get(s.view.name))) for s in papers}
    shiny = shining(shares)
    if shiny:
        veils, shares = {}, {s.view.name: square_ratios(s.reading) for s in papers}
        _leave_black(observations, shiny, remarks)
    unsharp = washed_out(shares, shiny, whites)
    kept = []
    for observation in observations:
        why = (
            "the photo is dark: no light on the board"
            if observation.dark
            else unsharp.get(observation.view.name)
        )
        if why is None:
            kept.append(observation)
        else:
            remarks.leave_out(
                observation.view.name, why, "dark-photo" if observation.dark else "unsharp-print"
            )
    if all(s.probe for s in kept):
        raise InputError(photoset.folder / MANIFEST, "no sample photo can be used: " + remarks.reasons())
    hand_over(observations, kept)
    return kept, veils


def settled_at_last(
    photoset: PhotoSet, observations: list[Observation], settle_for: Settle
) -> tuple[Settled, Beam | None, Beside | None, Falloff | None]:
    """Everything settled, once more for each thing that shows by it: a thick sample's shadow, narrow lamps, a lens that
    darkens its pictures, a room that is not dark; and the last three of these. ``settle_for``: :func:`settled_from`
    of the set and its ``observations``, for a beam and a falloff."""
    seen = [list(observation.highlights) for observation in observations]
    lens = photoset.radiometry.vignetting == "auto"
    settled = settle_for(0.0, NO_FALLOFF)
    if isinstance(photoset.sample, Plane) and is_thick(photoset.board, photoset.sample):
        clear_of_slab(photoset.sample, settled, observations)
        start_over(observations, seen)
        settled = settle_for(0.0, NO_FALLOFF)
    settled, beam, falloff = settle_allowing(settle_for, settled, observations, seen, lens=lens)
    beside = light_beside(settled.shading)
    if beside is not None and beside.told:
        # anew: what the room does may have passed for a beam, and have hidden what the lens does
        expect(observations, seen, beside)
        settled = settle_for(0.0, NO_FALLOFF)
        settled, beam, falloff = settle_allowing(settle_for, settled, observations, seen, lens=lens)
    return settled, beam, beside, falloff


def settled_from(
    photoset: PhotoSet,
    reader: Reader,
    model: CameraModel,
    camera: Camera,
    boards: list[Posed],
    observations: list[Observation],
    tell: Progress,
    narrow: float = 0.0,
    falloff: tuple[float, float] = NO_FALLOFF,
) -> Settled:
    """Everything settled together, from what observations hold: corners, highlights, limbs and paper. ``narrow``: the
    power of the cosine with which the lamps are known to shine, about."""
    sample = start_sample(camera, observations, photoset.sample)
    scene = start_scene(photoset, camera, observations, sample, narrow, falloff)
    groups: dict[str, list[Observation]] = {}
    for observation in observations:
        groups.setdefault(observation.light, []).append(observation)
    wanted = {name: members for name, members in groups.items() if any(not s.probe for s in members)}
    lamps = start_lamps(photoset, camera, wanted, scene, tell, reader.workers)
    return settle(photoset, reader, model, camera, boards, observations, lamps, scene, sample, tell)


def _leave_black(observations: list[Observation], shiny: list[str], remarks: Remarks) -> None:
    """Read the paper's white alone, in all photos: what black shows of the lamp differs from each to each."""
    for observation in observations:
        reading = observation.reading
        if reading is not None:
            observation.reading = white_alone(reading)
    remarks.residuals["shining_print"] = shiny
    remarks.tell(
        "glossy-print",
        f"the black print is no even share of the white beside it, in {len(shiny)} photos ({listed(shiny)}): it "
        "shines, or light spreads in the lens. Only the white is read; print on matte paper, without toner",
        views=tuple(shiny),
        amount=len(shiny),
        allowed=True,
    )


def _with_lamp(settled: Settled, observations: list[Observation], remarks: Remarks) -> list[Observation]:
    """The sample's observations whose lamp was found and may be believed."""
    doubts = {
        name: contradiction(settled, [s for s in observations if s.light == name]) for name in settled.lamps
    }
    kept = []
    for observation in observations:
        if observation.probe:
            continue
        why = doubts.get(
            observation.light, f"light {observation.light!r} is seen in no mirror ball and on no paper"
        )
        if why is None:
            kept.append(observation)
        else:
            remarks.leave_out(observation.view.name, why, "lamp-not-believed")
    return kept


def _views(
    photoset: PhotoSet,
    reader: Reader,
    settled: Settled,
    observations: list[Observation],
    falloff: Falloff | None,
    veils: Mapping[str, Veil],
    remarks: Remarks,
) -> tuple[list[ViewSetup], str]:
    lights: dict[str, Light] = {}
    readings, given, kept = {}, {}, []
    lit = _with_lamp(settled, observations, remarks)
    read = reader.abreast(
        lambda observation: _read(photoset, reader, settled, observation, falloff, veils), lit
    )
    for observation, found in zip(lit, read, strict=True):
        name = observation.view.name
        if found is None:
            remarks.leave_out(name, reader.failed[name], "unreadable-photo")
            continue
        lights[name], readings[name], channels = found
        entry = settled.lamps[observation.light].entry
        intensity = np.asarray(entry.intensity if entry is not None else (1.0,), float)
        given[name] = np.broadcast_to(intensity, (channels,)).copy()
        kept.append(observation)
    for name in denied_by_patch(settled, kept, readings):
        remarks.leave_out(
            name,
            "the white patch is not lit as by the lamp that the mirror balls seem to show",
            "lamp-not-believed",
        )
        del readings[name]
    kept = [s for s in kept if s.view.name in readings]
    if not kept:
        return [], "relative"
    tied, scale = tie(photoset, readings, lights, given, remarks)
    views = []
    for s in kept:
        one = tied[s.view.name]
        view = ViewSetup(
            s.view.name,
            lights[s.view.name],
            s.pose,
            one.value,
            one.error,
            one.source,
            s.pose_rms,
            settled.covariance.get(s.pose_block),
            marks(photoset, settled, s),
        )
        views.append(lifted_view(view, veils.get(s.view.name)))
    return views, scale


def _read(
    photoset: PhotoSet,
    reader: Reader,
    settled: Settled,
    observation: Observation,
    falloff: Falloff | None,
    veils: Mapping[str, Veil],
) -> tuple[Light, StrengthReadings, int] | None:
    """One view's light, what patch and paper say of its strength, and the number of channels."""
    box = patches_box(settled.camera, observation.pose, photoset.white_patches)
    image = reader.part(observation.view, box)
    if image is None:
        return None
    image = lifted_image(image, veils.get(observation.view.name))
    if falloff is not None and falloff.allowed:
        image = brightened_image(image, settled.camera, falloff)
    light = light_of(settled, observation)
    return light, read_view(photoset, image, settled, observation, light), image.value.shape[2]


def light_of(settled: Settled, observation: Observation) -> Light:
    """The lamp of one view as it settled, in the world frame."""
    lamp = settled.lamps[observation.light]
    block = settled.values[block_name(lamp.name)]
    covariance = settled.covariance.get(block_name(lamp.name), np.zeros((3, 3)))
    place = place_in_world(lamp, block, observation.pose)
    if lamp.attached:
        covariance = observation.pose.rotation.T @ covariance @ observation.pose.rotation
    if lamp.kind == "directional":
        place = place / np.linalg.norm(place)
        across = np.eye(3) - np.outer(place, place)
        covariance = across @ covariance @ across
    misses = settled.misses.get(lamp.name)
    rms = float(np.sqrt(np.mean(misses**2))) if misses is not None and len(misses) else float("nan")
    radius = lamp.entry.radius if lamp.entry is not None and lamp.entry.radius is not None else 0.0
    if settled.scene is not None and radius == 0.0 and lamp.kind == "point":
        radius = settled.scene.lamp_radius
    return Light(lamp.name, lamp.kind, place, covariance, lamp.source, radius, rms)


def _plane_move(photoset: PhotoSet, settled: Settled, observations: list[Observation]) -> PlaneMove | None:
    if not isinstance(photoset.sample, Plane):
        return None
    seen = [(s.pose, s.edges) for s in observations if s.edges is not None]
    still = all(s.pose_block == FIXED_POSE for s in observations)
    return lying(settled.camera, seen, photoset.sample, still)


def _sample(photoset: PhotoSet, settled: Settled, move: PlaneMove | None) -> Sphere | Plane:
    if isinstance(photoset.sample, Plane):
        return photoset.sample if move is None else move.applied(photoset.sample)
    if not believed(photoset, settled):
        return photoset.sample
    block = settled.values["sample"]
    return Sphere(block[:3].copy(), float(block[3]))


def _board(settled: Settled, block: str, corners: Corners, pose: Pose) -> BoardSetup:
    pose = block_pose(settled.values.get(block, pose_block(pose)))
    drawn = board_marks(settled, corners, pose)
    rms = float(np.sqrt(np.mean((drawn.corner_misses**2).sum(1))))
    return BoardSetup(block.removeprefix(POSE), pose, rms, settled.covariance.get(block), drawn)


def _mirror_balls(photoset: PhotoSet, settled: Settled) -> tuple[MirrorBall, ...]:
    blocks = [settled.values[f"ball {k}"] for k in range(len(photoset.mirror_balls))]
    return tuple(MirrorBall(b[:3].copy(), float(b[3])) for b in blocks)
