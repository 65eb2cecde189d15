"""All photos of a set at first sight, before it is known what camera took them and where it stood."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from photogonio.calib.detect.photo_reader import BothWays, Reader, Seen
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.remarks import Remarks
from photogonio.capture.photoset import PhotoSet


@dataclass(frozen=True, slots=True)
class Photos:
    """All photos with their corners, by role."""

    samples: list[Seen]
    probes: list[Seen]
    boards: list[Seen]  # calibration photos

    @property
    def every(self) -> list[Seen]:
        return self.boards + self.samples + self.probes

    def replaced(self, every: list[Seen]) -> Photos:
        """The same with other corners; inverse of ``every``."""
        first, second = len(self.boards), len(self.boards) + len(self.samples)
        return Photos(every[first:second], every[second:], every[:first])

    def as_read(self, photoset: PhotoSet) -> PhotoSet:
        """The set whose photos are turned as these are."""
        seen = {photo.file: photo.turned for one in self.every for photo in one.view.photos}
        return photoset.turned_to(p.file for p in photoset.photos if seen.get(p.file, p.turned))


@dataclass(frozen=True, slots=True)
class FirstLook:
    """What is known of a set so far. ``remarks`` is the log of the whole calibration."""

    photoset: PhotoSet  # with the board as the photos show it
    reader: Reader
    photos: Photos
    remarks: Remarks
    camera: Camera | None = None  # a rough one, or the given one, once there is one
    # a few photos' corners as a rough camera places them, with the markers and without
    both_ways: Mapping[int, BothWays] = field(default_factory=dict)  # by number
    bare: bool = False  # whether corners are to be placed without the markers
