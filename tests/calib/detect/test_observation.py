"""What is known of one photo: its light, its paper, and what passes from one that is left out."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from photogonio.calib.detect.limb import Limb
from photogonio.calib.detect.observation import (
    Observation,
    channel_names,
    hand_over,
    light_entry,
    light_id,
)
from photogonio.calib.geometry.camera import Pose
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import LightEntry, Photo, PhotoSet, Sphere, View

SET = PhotoSet(Path("."), "a", "mm", Sphere(np.zeros(3), 1.0), "auto", ())
LIMB = Limb(np.zeros((3, 2)), np.ones(3))


def view(name: str, light: str | None = None, role: str = "sample") -> View:
    return View((Photo(name, role, light),))


def seen(name: str, block: str = "pose fixed", role: str = "sample") -> Observation:
    return Observation(view(name, role=role), "one", None, Pose(np.eye(3), np.zeros(3)), block)


def test_a_view_that_names_no_light_has_the_only_one_or_its_own():
    one, other = LightEntry("one"), LightEntry("other")
    for lights, name, expected in (
        ((one,), None, "one"),
        ((one, other), None, "a.png"),
        ((one, other), "other", "other"),
        ((one,), "third", "third"),
        ((), None, "a.png"),
    ):
        photoset = replace(SET, lights=lights)
        assert light_id(photoset, view("a.png", name)) == expected
        entry = light_entry(photoset, view("a.png", name))
        assert (entry.id if entry else None) == (expected if expected in {e.id for e in lights} else None)


def test_paper_is_set_aside_and_brought_in_anew(drawn):
    _, (reading, *_) = drawn
    kept, asked = [], []

    def keep(one):
        kept.append(one)

        def recall():
            asked.append(one)
            return one

        return recall

    observation = seen("a")
    assert observation.reading is None and not observation.has_paper
    observation.keep = keep
    observation.reading = reading
    assert kept == [reading] and asked == [] and observation.has_paper
    assert observation.reading is reading and asked == [reading]
    observation.reading = None
    assert not observation.has_paper and observation.reading is None


@pytest.mark.parametrize(
    ("others", "heir"),
    [
        ([seen("b"), seen("c")], 0),
        ([seen("b", role="probe"), seen("c")], 1),
        ([seen("b", block="pose b"), seen("c")], 1),
        ([seen("b", block="pose b")], None),
        ([], None),
    ],
)
def test_what_a_still_cameras_photos_show_together_goes_to_one_that_is_kept(others, heir):
    """To the first of the same place that is no probe; where there is none it stays."""
    first, kept = seen("a"), [replace(one, limb=None) for one in others]
    first.limb = LIMB
    hand_over([first, *kept], kept)
    assert [one.limb is LIMB for one in kept] == [k == heir for k in range(len(kept))]
    assert (first.limb is None) == (heir is not None)


def test_a_photo_that_is_kept_keeps_its_own():
    first, other = seen("a"), seen("b")
    first.limb = LIMB
    hand_over([first, other], [first, other])
    assert first.limb is LIMB and other.limb is None


def test_channels_have_names():
    assert channel_names(1) == ("Y",) and channel_names(3) == ("R", "G", "B")
    assert channel_names(5) == ("C0", "C1", "C2", "C3", "C4")
    with pytest.raises(InputError, match="has no channels"):
        channel_names(0)
