"""Many sets of one rig: which sets are of one, what they say of it together, and what each is told by the others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median_low
from typing import Any

import numpy as np

from photogonio.batch.ledger import SetEntry
from photogonio.cache.kept import key_of
from photogonio.calib.rig.gaussian import RigExpected, RigPrior, RigTold
from photogonio.calib.rig.pooling import FEWEST, Pool, expected_of, pooled
from photogonio.calib.rig.values import BALL, CAMERA, LAMP, LIGHT, PAPER, WORDS, changes_of, kind_of, steady
from photogonio.calib.setup_file import told_of
from photogonio.capture.files.images import read_header, read_optics
from photogonio.capture.photoset import CharucoBoard, GridBoard, PhotoSet

POOL = "pool.json"


@dataclass(frozen=True, slots=True)
class SetsOfRig:
    """Sets that say to be of one rig, and what they have in common."""

    name: str
    marks: Mapping[str, object]  # by which it is told from others: see marks_of
    sets: tuple[str, ...]
    pools: tuple[Pool, ...]
    members: Mapping[str, tuple[str, ...]]  # by pool: the sets that say something of its values

    def left_out(self, pool: Pool) -> tuple[str, ...]:
        """Sets that contradict the others."""
        members = self.members[pool.name]
        return tuple(name for name, used in zip(members, pool.used, strict=True) if not used)

    def to_dict(self) -> dict[str, object]:
        """For pool.json."""
        return {
            "rig": self.name,
            "told_by": dict(self.marks),
            "sets": list(self.sets),
            "learned": [_learned(self, pool) for pool in self.pools],
        }


def marks_of(photoset: PhotoSet) -> dict[str, object]:
    """What a rig is told from others by: what manifest and EXIF say of camera, lens, board, lamps and radiometry.

    Raises:
        InputError: a photo cannot be read.
    """
    files = sorted({p.file for p in photoset.photos if p.role == "sample"})
    said = [read_optics(photoset.folder / name) for name in files]
    header = read_header(photoset.folder / files[0], demosaic=photoset.radiometry.demosaic)
    optics: dict[str, object] = {}
    for name in sorted({name for one in said for name in one}):
        found = sorted({str(one.get(name, "")) for one in said})
        optics[name] = found[0] if len(found) == 1 else found
    stops = sorted({p.f_number for p in photoset.photos if p.role == "sample" and p.f_number is not None})
    if stops:
        optics["f-number"] = [float(one) for one in stops]
    radiometry = photoset.radiometry
    return optics | {
        "picture": [int(side) for side in header.size],
        "camera matrix": _plain(photoset.camera.matrix),
        "board": _board(photoset),
        "mirror balls": [[float(x) for x in (*b.center, b.radius)] for b in photoset.mirror_balls],
        "white patches": [[float(r) for r in patch.reflectance] for patch in photoset.white_patches],
        "lamps": sorted({_lamp_kind(one) for one in photoset.lights}),
        "encoding": [radiometry.encoding, radiometry.gamma, radiometry.vignetting, radiometry.demosaic],
        "unit": photoset.length_unit,
    }


def _plain(matrix: np.ndarray | None) -> object:
    return None if matrix is None else np.asarray(matrix, float).tolist()


def _board(photoset: PhotoSet) -> str:
    board = photoset.board
    if isinstance(board, CharucoBoard):
        size = f"{board.squares[0]} x {board.squares[1]} squares of {board.square_length:g}"
    elif isinstance(board, GridBoard):
        size = f"{board.markers[0]} x {board.markers[1]} markers {board.pitch:g} apart"
    else:
        return "none" if board is None else f"loose markers {key_of(board)[:8]}"
    return (
        f"{board.kind} {board.dictionary}, {size}, markers of {board.marker_length:g}, from {board.first_id}"
    )


def _lamp_kind(light: Any) -> str:
    return f"{light.kind or 'any'}, radius {light.radius}, attached to {light.attached_to}"


def rigs_of(entries: Sequence[SetEntry]) -> list[SetsOfRig]:
    """The rigs that sets are of, in the order of their first sets. ``entries`` are what ``batch.learn`` found."""
    groups: dict[str, list[SetEntry]] = {}
    for entry in entries:
        if "marks" in entry.numbers:
            groups.setdefault(key_of(_frozen(entry.numbers["marks"])), []).append(entry)
    return [_rig(f"rig {k + 1}", group) for k, group in enumerate(groups.values())]


def _frozen(value: object) -> object:
    """JSON's values, as a key is made of."""
    if isinstance(value, Mapping):
        return {str(name): _frozen(one) for name, one in value.items()}
    return [_frozen(one) for one in value] if isinstance(value, (list, tuple)) else value


def _rig(name: str, group: Sequence[SetEntry]) -> SetsOfRig:
    told = _told(group)
    pools, members = [], {}
    for values, found in sorted(told.items()):
        pool = pooled([one for _, one in found], _changes(found))
        if pool is not None and steady(values, pool.value, pool.between):
            pools.append(pool)
            members[values] = tuple(one for one, _ in found)
    marks: Any = group[0].numbers["marks"]
    return SetsOfRig(name, marks, tuple(entry.set for entry in group), tuple(pools), members)


def _told(group: Sequence[SetEntry]) -> dict[str, list[tuple[str, RigTold]]]:
    """By values: the sets that tell them, with what they tell. Of cameras those with the commonest distortion terms."""
    found: dict[str, list[tuple[str, RigTold]]] = {}
    for entry in group:
        listed: Any = entry.numbers.get("told", [])
        for one in map(told_of, listed):
            found.setdefault(one.name, []).append((entry.set, one))
    cameras = sorted((-len(v), len(k), k) for k, v in found.items() if kind_of(k) == CAMERA)
    for _, _, name in cameras[1:]:
        del found[name]
    lengths = {name: median_low(len(one.value) for _, one in v) for name, v in found.items()}
    return {n: [(s, o) for s, o in v if len(o.value) == lengths[n]] for n, v in found.items()}


def _changes(found: Sequence[tuple[str, RigTold]]) -> list[np.ndarray]:
    return changes_of(found[0][1].name, np.median([one.value for _, one in found], axis=0))


def expectations(rig: SetsOfRig, entries: Sequence[SetEntry]) -> dict[str, RigPrior]:
    """What each set of a rig is told by the others, by set; nothing of values in which it contradicts them."""
    told = _told([entry for entry in entries if entry.set in rig.sets])
    expected: dict[str, list[RigExpected]] = {name: [] for name in rig.sets}
    differs: dict[str, list[str]] = {name: [] for name in rig.sets}
    for pool in rig.pools:
        found, members = told[pool.name], rig.members[pool.name]
        numbers, changes = [one for _, one in found], _changes(found)
        for name in rig.sets:
            number = members.index(name) if name in members else -1
            if number >= 0 and not pool.used[number]:
                differs[name].append(pool.name)
                continue
            one = expected_of(numbers, changes, pool, number)
            if one.sets >= FEWEST - 1:
                expected[name].append(one)
    return {name: RigPrior(tuple(expected[name]), tuple(differs[name])) for name in rig.sets}


def pool_document(rigs: Sequence[SetsOfRig], entries: Sequence[SetEntry]) -> dict[str, object]:
    """pool.json."""
    lost = {entry.set: entry.said for entry in entries if entry.said}
    return {
        "format": "photogonio-pool",
        "version": 1,
        "rigs": [rig.to_dict() for rig in rigs],
        "sets_that_say_nothing": lost,
    }


def _learned(rig: SetsOfRig, pool: Pool) -> dict[str, object]:
    members = rig.members[pool.name]
    return {
        "of": pool.name,
        "words": WORDS[kind_of(pool.name)],
        "value": pool.value.tolist(),
        "standard_error": np.sqrt(np.diag(pool.covariance)).tolist(),
        "from_set_to_set": np.sqrt(np.diag(pool.between)).tolist(),
        "covariance": pool.covariance.tolist(),
        "between": pool.between.tolist(),
        "sets": [name for name, used in zip(members, pool.used, strict=True) if used],
        "left_out": [
            {"set": name, "chance": chance}
            for name, used, chance in zip(members, pool.used, pool.chance, strict=True)
            if not used
        ],
    }


def rig_words(rig: SetsOfRig) -> list[str]:
    """What was learned, a line each."""
    if not rig.pools:
        why = f"fewer than {FEWEST}" if len(rig.sets) < FEWEST else "too few agree"
        return [f"{rig.name}: {_count(len(rig.sets))}, {why}: nothing is taken over from one to another"]
    lines = [f"{rig.name}: {_count(len(rig.sets))} of one camera, board and lamps"]
    for pool in rig.pools:
        said = _SAID[kind_of(pool.name)](pool)
        out = rig.left_out(pool)
        lines.append(
            f"{rig.name}: {said}, by {_count(pool.sets)}" + (f"; without {', '.join(out)}" if out else "")
        )
    return lines


def _count(number: int) -> str:
    return "1 set" if number == 1 else f"{number} sets"


def _figures(pool: Pool, k: int) -> tuple[float, float, float]:
    """A value, its standard error, and what it changes from set to set."""
    return float(pool.value[k]), float(pool.covariance[k, k]) ** 0.5, float(pool.between[k, k]) ** 0.5


def _camera_said(pool: Pool) -> str:
    value, error, between = _figures(pool, 0)
    return f"focal length {value:.1f} +- {error:.2g} px, from set to set {between:.2g}"


def _lamp_said(pool: Pool) -> str:
    radius, error, between = _figures(pool, 0)
    corner = float(np.expm1(pool.value[3:].sum()))
    unsure = float(np.sqrt(pool.covariance[3:, 3:].sum()))
    return (
        f"lamp radius {np.exp(radius):.3g} +- {error:.1%}, from set to set {between:.1%}; light in the pictures' "
        f"corners {corner:+.1%} +- {unsure:.1%}"
    )


def _place_said(pool: Pool) -> str:
    place = ", ".join(f"{x:.1f}" for x in pool.value)
    error, between = (float(np.sqrt(np.trace(one) / 3.0)) for one in (pool.covariance, pool.between))
    return f"{pool.name} at {place} +- {error:.2g}, from set to set {between:.2g}"


def _ball_said(pool: Pool) -> str:
    value, error, between = _figures(pool, 0)
    return f"radius of mirror {pool.name} {np.exp(value):.4g} +- {error:.2%}, from set to set {between:.2%}"


def _paper_said(pool: Pool) -> str:
    white = ", ".join(f"{np.exp(x):.3f}" for x in pool.value)
    _, error, between = _figures(pool, 0)
    return f"reflectance of the paper {white} +- {error:.2%}, from set to set {between:.2%}"


_SAID = {CAMERA: _camera_said, LAMP: _lamp_said, LIGHT: _place_said, BALL: _ball_said, PAPER: _paper_said}
