"""Every sample view's lamp, and how strongly it shines, once all has settled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.calib.adjust.lamps import block_name, place_in_world
from photogonio.calib.adjust.state import Settled, State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.diagnose.photos.unusable_photos import denied_by_patch
from photogonio.calib.radiometry.patch import patches_box
from photogonio.calib.radiometry.readings import StrengthReadings, read_view
from photogonio.calib.radiometry.scale import Tied, tie
from photogonio.calib.report.summary import marks
from photogonio.calib.rig.values import PAPER
from photogonio.calib.setup import Light, ViewSetup
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST


@dataclass(frozen=True, slots=True)
class _Read:
    """One view's light, what patch and paper say of its strength, and the number of channels."""

    light: Light
    readings: StrengthReadings
    channels: int


def views_of(state: State) -> tuple[list[ViewSetup], str]:
    """The views that can be used, and whether their scale is "absolute" or "relative".

    Raises:
        InputError: none can.
    """
    lit = [one for one in state.observations if not one.probe]
    found: dict[str, _Read] = {}
    for observation, one in zip(lit, state.reader.abreast(lambda one: _read(state, one), lit), strict=True):
        name = observation.view.name
        if one is None:
            state.remarks.leave_out(name, state.reader.failed[name], "unreadable-photo")
        else:
            found[name] = one
    readings = {name: one.readings for name, one in found.items()}
    kept = [one for one in lit if one.view.name in found]
    for name in denied_by_patch(state.settled, kept, readings):
        why = "the white patch is not lit as by the lamp that the mirror balls seem to show"
        state.remarks.leave_out(name, why, "lamp-not-believed")
        del readings[name]
    kept = [one for one in kept if one.view.name in readings]
    if not kept:
        why = "no sample photo can be used: " + state.remarks.reasons()
        raise InputError(state.photoset.folder / MANIFEST, why)
    lights = {name: found[name].light for name in readings}
    tied, scale = tie(
        state.photoset, readings, lights, _given(state, kept, found), state.remarks, state.rig.get(PAPER)
    )
    return [_view(state, one, lights[one.view.name], tied[one.view.name]) for one in kept], scale


def _given(state: State, kept: Sequence[Observation], found: Mapping[str, _Read]) -> dict[str, np.ndarray]:
    """The manifest's relative strengths (c,) of each view's lamp."""
    given = {}
    for one in kept:
        entry = state.settled.lamps[one.light].entry
        intensity = np.asarray(entry.intensity if entry is not None else (1.0,), float)
        given[one.view.name] = np.broadcast_to(intensity, (found[one.view.name].channels,)).copy()
    return given


def _view(state: State, one: Observation, light: Light, tied: Tied) -> ViewSetup:
    settled, correction = state.settled, state.correction(one.view.name)
    return ViewSetup(
        one.view.name,
        light,
        one.pose,
        tied.value,
        tied.error,
        tied.source,
        one.pose_rms,
        settled.covariance.get(one.pose_block),
        marks(state.photoset, settled, one),
        correction.offset,
        correction.offset_error,
    )


def _read(state: State, observation: Observation) -> _Read | None:
    box = patches_box(state.settled.camera, observation.pose, state.photoset.white_patches)
    image = state.reader.part(observation.view, box)
    if image is None:
        return None
    image = state.correction(observation.view.name).of_image(image, state.settled.camera)
    light = light_of(state.settled, observation)
    readings = read_view(state.photoset, image, state.settled, observation, light)
    return _Read(light, readings, image.value.shape[2])


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
