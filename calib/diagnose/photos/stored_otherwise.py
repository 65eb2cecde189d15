"""Photos that are stored mirrored, or upside down, against the others: their lens has its axis elsewhere."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.diagnose.base import LookDeparture, Stage
from photogonio.calib.diagnose.photos.turned_photos import (
    mirrored_photos,
    turned_against_given,
    turned_against_lens,
    turned_photos,
    upright,
)
from photogonio.calib.remarks import listed
from photogonio.capture.diagnosis import Diagnosis, Entry


class MirroredPhotos(LookDeparture):
    """Photos in which no marker is one are left out."""

    stage = Stage.LOOK
    entries = (
        Entry(
            "photo-mirrored",
            "A photo is stored as its mirror image, against the others; it is left out.",
            "Store it as the camera took it; a program that shows pictures has mirrored it.",
        ),
    )

    def evidence(self, look: FirstLook) -> Sequence[Diagnosis]:
        names = mirrored_photos(look.reader, look.photos.every)
        return [Diagnosis("photo-mirrored", amount=len(names), views=tuple(names))] if names else []

    def remedy(self, look: FirstLook, found: Sequence[Diagnosis]) -> FirstLook:
        names, photos = found[0].views, look.photos
        for name in names:
            look.remarks.leave_out(name, "it is stored mirrored, against the other photos", "photo-mirrored")
        kept = (
            [one for one in part if one.view.name not in names]
            for part in (photos.samples, photos.probes, photos.boards)
        )
        return replace(look, photos=Photos(*kept))


class TurnedPhotos(LookDeparture):
    """A fixed camera's photos that show the board elsewhere, unless they are turned, are read turned back."""

    stage = Stage.LOOK
    entries = (
        Entry(
            "photo-turned",
            "Photos are stored upside down against the others, or against the given camera: their lens has its axis "
            "elsewhere in the picture. They are read turned back.",
            "Nothing; or turn them back by 180 degrees without compressing them anew.",
        ),
    )

    def evidence(self, look: FirstLook) -> Sequence[Diagnosis]:
        if look.photoset.board is None or not look.photoset.camera.fixed:
            return []
        still = [one for one in look.photos.samples + look.photos.probes if one.corners is not None]
        turned = turned_photos([(one.corners, one.size) for one in still if one.corners is not None])
        return _told({still[k].view.name for k in turned})

    def remedy(self, look: FirstLook, found: Sequence[Diagnosis]) -> FirstLook:
        return _turned_back(look, found[0].views)


class TurnedLens(LookDeparture):
    """Photos with the axis on the other side of the middle than most, or than the given camera has it, likewise."""

    stage = Stage.CLOSER
    entries = ()  # told as those of a fixed camera

    def evidence(self, look: FirstLook) -> Sequence[Diagnosis]:
        camera, photos = look.camera, look.photos
        if camera is None:
            return []
        shown = [one for one in photos.every if one.corners is not None and one.size == camera.size]
        corners = [one.corners for one in shown if one.corners is not None]
        find = turned_against_lens if look.photoset.camera.matrix is None else turned_against_given
        names = {shown[k].view.name for k in find(camera, corners)}
        if look.photoset.camera.fixed:  # one and the same side, and those that are not were found before
            still = {one.view.name for one in photos.samples + photos.probes}
            told = [one.view.name for one in shown if one.view.name in still]
            most = 2 * sum(name in names for name in told) > len(told)
            names = names - still | (still if most else set())
        return _told(names)

    def remedy(self, look: FirstLook, found: Sequence[Diagnosis]) -> FirstLook:
        return _turned_back(look, found[0].views)


def _told(turned: Collection[str]) -> list[Diagnosis]:
    """That photos are read half a turn about, against how they are stored."""
    names = tuple(sorted(turned))
    if not names:
        return []
    how = f"{listed(names)}: {'is' if len(names) == 1 else 'are'} stored turned by 180 degrees against the others"
    message = f"{how}, and read turned back"
    return [Diagnosis("photo-turned", message, len(names), views=names, allowed=True)]


def _turned_back(look: FirstLook, names: Collection[str]) -> FirstLook:
    every = [upright(one) if one.view.name in names else one for one in look.photos.every]
    return replace(look, photos=look.photos.replaced(every))
