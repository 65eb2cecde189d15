"""Photos that name one light although it stood in several places: each place becomes a light of its own.

It is one lamp that people carry about, so that they give it one id. Highlights that lie alike in the mirror balls say
that nothing moved; where they do not, or there are none, each photo's own paper says where its lamp stood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.adjust.lamps import middle_of, sight_rays
from photogonio.calib.adjust.start import start_sample, start_scene
from photogonio.calib.adjust.state import State
from photogonio.calib.detect.mirror_rays import MirroredRay
from photogonio.calib.detect.observation import Observation, light_entry
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.board import board_size
from photogonio.calib.shading.fit import ShadingFit, fit_shading
from photogonio.calib.shading.initial import first_fit
from photogonio.calib.shading.model import ShadingScene
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.photoset import PhotoSet

SHARED_APART = np.radians(5.0)  # by which photos of one light may have it apart, and
SURE_APART = 4.0  # standard errors of it
_FINER = np.radians(1.0)  # by which places are told apart once it is known that the lamp moved
_BY_BALL = np.radians(30.0)  # the same by a mirror ball that another camera sees: it may stand elsewhere
_STEPS = 8
_NAMED = 3  # photos named of each place


@dataclass(frozen=True, slots=True)
class _Told:
    """What one photo says of where its lamp is."""

    observation: Observation
    rays: dict[int, MirroredRay]  # by mirror ball
    fit: ShadingFit | None  # by its paper

    def apart(self, other: _Told, least: float = SHARED_APART) -> float | None:
        """Angle, radians, between the lamp's directions in two photos where it is surely not nothing; None if nothing
        that both show compares them."""
        if self.fit is not None and other.fit is not None:
            angle = _angle(self.fit.place, other.fit.place)
            sure = SURE_APART * float(np.hypot(aside(self.fit), aside(other.fit)))
            return angle if angle > max(least, sure) else 0.0
        common = self.rays.keys() & other.rays.keys()
        if not common:
            return None
        still = self.observation.pose_block == other.observation.pose_block
        angle = min(_angle(self.rays[k].direction, other.rays[k].direction) for k in common)
        return angle if angle > (SHARED_APART if still else _BY_BALL) else 0.0


def aside(fit: ShadingFit) -> float:
    """Standard error, radians, of the direction in which one photo's paper has its lamp."""
    far = float(np.linalg.norm(fit.place))
    across = np.eye(3) - np.outer(fit.place, fit.place) / far**2
    return float(np.sqrt(np.linalg.norm(across @ fit.covariance() @ across, 2))) / far


class MovedLamp(Departure):
    """Photos of one light that show it in several places: each becomes a light of its own."""

    stage = Stage.PHOTO
    entries = (
        Entry(
            "lamp-in-several-places",
            "Photos of one light show it in several places: each is taken as a light of its own where "
            "that can be told.",
            "Give each place of a lamp an `id` of its own.",
            least=0.0873,
            sigmas=4.0,
            source="radians; single photos' paper has drawn lamps at most 0.031 beside their directions",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        return [_told(name, groups) for name, groups in places_apart(state) if len(_wanted(groups)) > 1]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State:
        names = {view: light for one in found for view, light in one.grounds.items()}
        lights = [names.get(one.view.name, one.light) for one in state.observations]
        return state.keeping(replace(o, light=n) for o, n in zip(state.observations, lights, strict=True))


def places_apart(state: State) -> list[tuple[str, list[list[_Told]]]]:
    """Lights that stood in several places, and the photos of each place."""
    photoset, camera, observations = state.photoset, state.camera, state.observations
    groups: dict[str, list[Observation]] = {}
    for observation in observations:
        entry = light_entry(photoset, observation.view)
        told = entry is not None and (
            entry.attached_to is not None
            or entry.position is not None
            or entry.direction is not None
            or bool(entry.marker_ids)
        )
        if not told:
            groups.setdefault(observation.light, []).append(observation)
    rays = {s.view.name: {r.ball: r for r in sight_rays(photoset, camera, s)} for s in observations}
    doubtful = {
        name: members
        for name, members in groups.items()
        if len(members) > 1 and not _one_place(members, rays)
    }
    if not doubtful:
        return []
    apart = []
    scene = start_scene(photoset, camera, observations, start_sample(camera, observations, photoset.sample))
    for name, members in doubtful.items():
        found = state.reader.abreast(
            lambda s: _Told(s, rays[s.view.name], direction_by_paper(photoset, s, rays, scene)), members
        )
        photos = list(found)
        if len(_places(photos, SHARED_APART)) > 1:
            apart.append((name, _places(photos, _FINER)))
    return apart


def _one_place(members: list[Observation], rays: dict[str, dict[int, MirroredRay]]) -> bool:
    """Whether each mirror ball that shows the lamp shows it alike in all photos of one light."""
    for one in rays[members[0].view.name].items():
        ball, ray = one
        others = [rays[s.view.name].get(ball) for s in members[1:]]
        if all(o is not None and _angle(o.direction, ray.direction) < SHARED_APART for o in others):
            return True
    return False


def direction_by_paper(
    photoset: PhotoSet,
    observation: Observation,
    rays: dict[str, dict[int, MirroredRay]],
    scene: ShadingScene | None,
) -> ShadingFit | None:
    reading = observation.reading
    if scene is None or reading is None or photoset.board is None:
        return None
    diagonal = float(np.hypot(*board_size(photoset.board)))
    own = list(rays[observation.view.name].values())
    local = first_fit(reading, scene, own, middle_of(photoset), diagonal)
    return fit_shading(reading, scene, local, _STEPS)


def _places(told: list[_Told], least: float) -> list[list[_Told]]:
    """Photos that have their lamp in one place, together; those of which nothing tells stay with the first."""
    groups: list[list[_Told]] = []
    for one in sorted(told, key=lambda t: t.fit is None):  # those that tell most make the places
        angles = [one.apart(group[0], least) for group in groups]
        home = next((k for k, angle in enumerate(angles) if angle == 0.0), None)
        if home is None and None in angles:
            home = angles.index(None)
        if home is None:
            groups.append([one])
        else:
            groups[home].append(one)
    return groups


def _wanted(groups: list[list[_Told]]) -> list[list[_Told]]:
    """Places that photos of the sample show."""
    return [group for group in groups if any(not t.observation.probe for t in group)]


def _told(name: str, groups: list[list[_Told]]) -> Diagnosis:
    """Lights of their own for all places but the first, and the warning."""
    wanted = _wanted(groups)
    worst = max(a for g in wanted[1:] if (a := g[0].apart(wanted[0][0])) is not None)
    lists = [", ".join(t.observation.view.name for t in group[:_NAMED]) for group in wanted[:_NAMED]]
    more = ", and so on" if len(wanted) > _NAMED or any(len(g) > _NAMED for g in wanted) else ""
    return Diagnosis(
        "lamp-in-several-places",
        f"photos of light {name!r} show it in directions {np.degrees(worst):.0f} degrees apart, in {len(wanted)} "
        f"places ({'; '.join(lists)}{more}): each is taken as a light of its own; give each place of a lamp an id of "
        "its own",
        amount=float(worst),
        least=float(SHARED_APART),
        sigmas=SURE_APART,
        views=tuple(t.observation.view.name for group in wanted for t in group),
        allowed=True,
        grounds={
            t.observation.view.name: f"{name} ({number})"
            for number, group in enumerate(groups[1:], 2)
            for t in group
        },
    )


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    cross, dot = np.linalg.norm(np.cross(one, other)), float(one @ other)
    return float(np.arctan2(cross, dot))
