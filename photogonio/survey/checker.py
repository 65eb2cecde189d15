"""What each photo shows by itself and adds to those before it, one after another as they come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogonio.cache.glances import Glances
from photogonio.cache.store import default_store
from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.geometry.board import Corners, board_size, opencv_board
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.pose import PoseFit, fit_pose
from photogonio.calib.identify.layout import Markers, find_board
from photogonio.calib.identify.quick_look import QuickLook, quick_look
from photogonio.calib.identify.sharpness import Sharpness
from photogonio.capture.errors import InputError
from photogonio.capture.files.exposure import Exposure, combine
from photogonio.capture.files.images import read_header, read_image
from photogonio.capture.linear.alone import encoding_alone, gray_alone
from photogonio.capture.photoset import (
    Board,
    CharucoBoard,
    GridBoard,
    LightEntry,
    Photo,
    PhotoSet,
    Radiometry,
    Sphere,
)
from photogonio.reconstruct.design.spots import BESIDE, Piece, Spot, Stance, apart
from photogonio.survey.folder import SetFolder
from photogonio.survey.sample_place import clipped_share, middle_of, piece_of

if TYPE_CHECKING:
    from photogonio.reconstruct.design.belief import Belief

OFTEN = 4  # photos, up to which the camera is fitted anew with each
SELDOM = 1.5  # times as many as at the last fit, later
NO_EXPOSURE = Exposure()
FLASH_WITHIN = 5.0  # degrees between camera and lamp, by how the paper is lit: a flash
MARGIN = 0.18  # of the board's shorter side: about how large a sample is of which nothing is known


@dataclass(frozen=True, slots=True)
class LampFound:
    """Where a photo's lamp stands."""

    place: np.ndarray  # (3,) board frame
    source: str  # "manifest" | "flash" | "mirror balls" | "paper"
    attached: bool = False


@dataclass(frozen=True, slots=True)
class Checked:
    """One photo."""

    photo: Photo
    fault: str | None = None  # why it cannot be read; nothing else is known then
    exposure: Exposure = NO_EXPOSURE
    flash: bool | None = None
    camera_name: str = ""
    size: tuple[int, int] = (0, 0)
    white: float = float("nan")  # bright parts over white level
    clipped: float = 0.0  # share of all pixels
    clipped_sample: float | None = None  # of the sample's; None: its place is not known
    sharp: Sharpness | None = None
    corners: int | None = None  # of the board; None: no board is known
    residual: float | None = None  # pixels rms of its corners
    shot: Stance | None = None  # camera and lamp, about the sample's middle
    camera: Spot | None = None
    lamp: LampFound | None = None
    adds: float | None = None  # share of what is left open of f (mean variance) that it takes away


@dataclass(slots=True)
class Checker:
    """Looks at photos of one set."""

    folder: SetFolder
    board: Board | None = None
    glances: Glances = field(default_factory=lambda: Glances(None))
    seen_board: bool = False  # the photos told of it, not a manifest
    camera: Camera | None = None
    belief: Belief | None = None
    shots: list[Stance] = field(default_factory=list)
    _corners: list[Corners] = field(default_factory=list)
    _markers: list[Markers] = field(default_factory=list)
    _fitted: int = 0
    _begun: bool = False  # a lamp was looked for
    _latest: tuple[Path, np.ndarray, np.ndarray] | None = None  # the photo that was read last

    @classmethod
    def of(cls, folder: SetFolder) -> Checker:
        """A checker that has seen nothing yet."""
        photoset = folder.photoset
        return cls(folder, None if photoset is None else photoset.board, Glances(default_store()))

    def look(self, photo: Photo, early: Callable[[Checked], None] = lambda one: None) -> Checked:
        """What one more photo shows and adds. ``early`` is given what is known before the first lamp is looked for,
        which takes seconds while compiled code and optimisers are brought in."""
        path = self.folder.path / photo.file
        try:
            header = read_header(path, demosaic=self._radiometry.demosaic)
            seen = self._seen(path)
        except InputError as error:
            return Checked(photo, fault=error.what)
        found = Checked(
            photo,
            exposure=combine(photo, header.exposure),
            flash=header.flash,
            camera_name=header.camera,
            size=seen.size,
            white=seen.white,
            clipped=seen.clipped,
            sharp=seen.sharp,
            corners=None if seen.corners is None else len(seen.corners),
        )
        fit = self._posed(seen)
        return found if fit is None else self._placed(found, seen, fit, early)

    @property
    def _radiometry(self) -> Radiometry:
        photoset = self.folder.photoset
        return Radiometry() if photoset is None else photoset.radiometry

    def scene(self) -> PhotoSet | None:
        """The manifest's set, or one with the board that was found and a sample in the middle of it."""
        if self.board is None:
            return None
        if self.folder.photoset is not None:
            return replace(self.folder.photoset, board=self.board)
        size = board_size(self.board)
        radius = MARGIN * float(size.min())
        sample = Sphere(np.append(0.5 * size, radius), radius)
        return PhotoSet(self.folder.path, "", "mm", sample, "auto", (), self.board)

    def _seen(self, path: Path) -> QuickLook:
        """A look at a photo; one that first tells of the board is looked at once more, for its corners.

        Raises InputError if it cannot be read."""
        seen = self._glance(path)
        told, corners = seen.markers, seen.corners
        if self._markers and corners is not None and beyond(self.board, corners.marker_ids):
            told = Markers(self._markers[0].family, corners.marker_ids, corners.marker_pixels)
        if told is None:
            return seen
        self._markers.append(told)
        found = find_board(self._markers)
        if found is None or found.board == self.board:
            return seen
        self.board, self.seen_board = found.board, True
        self._corners, self.camera = [], None  # a board of other rows has its corners elsewhere
        return self._glance(path)

    def _glance(self, path: Path) -> QuickLook:
        encoding, demosaic = encoding_alone(self._radiometry), self._radiometry.demosaic
        key = self.glances.key(path, encoding, demosaic, self.board)
        seen = self.glances.get(key)
        if seen is None:
            if self._latest is None or self._latest[0] != path:
                level, usable = gray_alone(read_image(path, demosaic=demosaic), encoding)
                self._latest = path, level, usable
            seen = quick_look(*self._latest[1:], self.board)
            self.glances.put(key, seen)
        return seen

    def _posed(self, seen: QuickLook) -> PoseFit | None:
        if not seen.clear or seen.corners is None:
            return None
        self._corners.append(seen.corners)
        given = None if self.folder.photoset is None else self.folder.photoset.camera
        if given is not None and given.matrix is not None:
            lens = np.zeros(0) if given.distortion is None else given.distortion
            self.camera = Camera(given.matrix, lens, seen.size)
        count = len(self._corners)
        due = self.camera is None or count <= OFTEN or count >= SELDOM * self._fitted
        if due and (given is None or given.matrix is None):
            self.camera = quick_camera(self._corners, seen.size)
            self._fitted = count
        return None if self.camera is None else fit_pose(self.camera, seen.corners)

    def _placed(
        self, found: Checked, seen: QuickLook, fit: PoseFit, early: Callable[[Checked], None]
    ) -> Checked:
        scene = self.scene()
        assert scene is not None and self.camera is not None
        middle = middle_of(scene)
        spot = Spot.of(fit.pose.center - middle)
        found = replace(found, residual=fit.rms, camera=spot)
        if found.photo.role != "sample":
            return found
        if self.folder.photoset is not None:
            found = replace(found, clipped_sample=clipped_share(scene, self.camera, fit.pose, seen))
        if not self._begun:
            self._begun = True
            early(found)
        lamp = self._lamp(scene, found, seen, fit.pose)
        if lamp is None:
            return found
        shot = Stance(spot, Spot.of(lamp.place - middle), lamp.attached)
        return replace(found, lamp=lamp, shot=shot, adds=self._added(shot, piece_of(scene)))

    def _added(self, shot: Stance, piece: Piece) -> float:
        self.shots.append(shot)
        if self.belief is None:
            from photogonio.reconstruct.design.materials import USUAL, of_material

            self.belief = of_material(USUAL)
        before = self.belief.mean_variance()
        self.belief = self.belief.seen(piece.pairs(shot))
        return 1.0 - self.belief.mean_variance() / before

    def _lamp(self, scene: PhotoSet, found: Checked, seen: QuickLook, pose: Pose) -> LampFound | None:
        entry = next((e for e in scene.lights if e.id == found.photo.light), None)
        if entry is None and len(scene.lights) == 1 and found.photo.light is None:
            entry = scene.lights[0]
        told = told_lamp(entry, pose, float(np.linalg.norm(board_size(scene.board))))  # type: ignore[arg-type]
        if told is not None:
            return told
        if entry is None and found.flash:
            return LampFound(beside(pose), "flash", True)
        # compiled code and optimisers are brought in when they are asked for: the first line is not to wait
        from photogonio.calib.identify.lamp_glance import glance_at_lamp

        assert self.camera is not None
        glance = glance_at_lamp(scene, self.camera, pose, seen)
        if glance is None:
            return None
        eye, middle = pose.center, middle_of(scene)
        near = apart(Spot.of(eye - middle), Spot.of(glance.place - middle)) < FLASH_WITHIN
        return LampFound(glance.place, glance.source, near and entry is None)


def beyond(board: Board | None, ids: np.ndarray) -> bool:
    """Whether markers are seen, more than one, that come after a board's last: it has more rows than were seen."""
    if not isinstance(board, CharucoBoard | GridBoard):
        return False
    return int((ids > int(np.max(opencv_board(board).getIds()))).sum()) > 1


def beside(pose: Pose) -> np.ndarray:
    """Where a flash beside the lens is, (3,) board frame."""
    return pose.center + BESIDE * float(np.linalg.norm(pose.translation)) * pose.rotation[0]


def told_lamp(entry: LightEntry | None, pose: Pose, size: float) -> LampFound | None:
    """The lamp that a manifest gives; ``size`` of the board, of which a distant lamp is many away."""
    if entry is None:
        return None
    if entry.attached_to == "camera":
        place = beside(pose) if entry.position is None else pose.inverse().apply(entry.position)
        return LampFound(place, "flash", True)
    if entry.position is not None:
        return LampFound(entry.position, "manifest")
    if entry.direction is not None:
        return LampFound(20.0 * size * entry.direction, "manifest")
    return None
