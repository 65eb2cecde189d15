"""All departures in the order in which they are asked for, and all that calibration may tell, by code.

To add one is to write its file and to name it here (docs/diagnoses.md is made of this).
"""

from __future__ import annotations

from photogonio.calib.diagnose.base import Departure, LightDeparture, LookDeparture, Stage
from photogonio.calib.diagnose.board.board_rows import BoardRows
from photogonio.calib.diagnose.board.board_shape import BoardPrint, CameraPhotos
from photogonio.calib.diagnose.board.marker_corners import MarkerCornerOrder
from photogonio.calib.diagnose.board.misplaced_markers import MisplacedMarkers
from photogonio.calib.diagnose.board.wrong_board import WrongBoard
from photogonio.calib.diagnose.lights.ambient_light import AmbientLight
from photogonio.calib.diagnose.lights.lamp_beam import LampBeam
from photogonio.calib.diagnose.lights.thick_sample import ThickSample
from photogonio.calib.diagnose.lights.vignetting import Vignetting
from photogonio.calib.diagnose.photos.displaced_ball import DisplacedBall
from photogonio.calib.diagnose.photos.ghosting import MovedInBracket
from photogonio.calib.diagnose.photos.glossy_print import GlossyPrint
from photogonio.calib.diagnose.photos.moved_lamp import MovedLamp
from photogonio.calib.diagnose.photos.outline_off_sample import OutlineOffSample
from photogonio.calib.diagnose.photos.outside_picture import SampleOutsidePicture
from photogonio.calib.diagnose.photos.stored_otherwise import MirroredPhotos, TurnedLens, TurnedPhotos
from photogonio.calib.diagnose.photos.tone_curve import WrongToneCurve
from photogonio.calib.diagnose.photos.unusable_photos import UnusablePhotos
from photogonio.calib.diagnose.photos.veiling_glare import VeilingGlare
from photogonio.calib.diagnose.places.flat_sample import FlatSample
from photogonio.calib.diagnose.places.lamp_places import LampNotBelieved, LonelyHighlights, SharedLight
from photogonio.calib.diagnose.places.mirror_balls import MirrorBalls
from photogonio.calib.diagnose.places.sample_ball import SampleBall
from photogonio.capture.diagnosis import Entry

LOOKS: tuple[LookDeparture, ...] = (
    MirroredPhotos(),
    TurnedPhotos(),
    MarkerCornerOrder(),
    WrongBoard(),
    MisplacedMarkers(),
    TurnedLens(),
)
LIGHT: tuple[LightDeparture, ...] = (ThickSample(), Vignetting(), LampBeam(), AmbientLight())
DEPARTURES: tuple[Departure, ...] = (
    SampleOutsidePicture(),
    CameraPhotos(),
    BoardRows(),
    BoardPrint(),
    OutlineOffSample(),
    DisplacedBall(),
    WrongToneCurve(),
    VeilingGlare(),  # before what black print tells of gloss and sharpness
    UnusablePhotos(),  # before black print is no longer read
    GlossyPrint(),
    MovedLamp(),
    *LIGHT,
    LampNotBelieved(),
    SampleBall(),
    MirrorBalls(),
    LonelyHighlights(),
    SharedLight(),
    FlatSample(),
    MovedInBracket(),
)
# what is told on the way, of which nothing follows but what is said
TOLD: dict[Stage, tuple[Entry, ...]] = {
    Stage.MANIFEST: (
        Entry(
            "copied-photo",
            "A photo is the same file as another, which would count twice; it is left out.",
            "Nothing.",
        ),
        Entry(
            "unreadable-photo",
            "A photo cannot be read, is of another size than the others, or lacks what they have; it is left out.",
            "Nothing, if there are enough others.",
        ),
        Entry(
            "corners-astray",
            "A photo of the bare board fits much worse than the others; it is left out.",
            "Nothing; such a photo is shaken, or the board was bent in it.",
        ),
        Entry(
            "no-pose",
            "Too few of a photo's board corners agree: nobody knows where the camera stood. It is left out.",
            "More of the board in the picture; sharper; flatter.",
        ),
    ),
    Stage.CAMERA: (
        Entry(
            "camera-moved",
            "The camera or the board was bumped: the board lies elsewhere in a photo than where a fixed "
            "camera sees it in "
            "the others. That photo has a pose of its own.",
            "Nothing.",
            least=1.0,
            source="pixels, the middle one of a photo's corners; drawn photos of a still camera have at most 0.04",
        ),
    ),
    Stage.STRENGTH: (
        Entry(
            "patches-uneven",
            "No white patch is evenly lit in any photo: the scale is by those that are not, and as unsure as is said.",
            "Move the patch out of shadows, reflections and the beam's edge, or use a lamp without a reflector.",
        ),
        Entry(
            "scale-by-kind-of-paper",
            "No white patch can be read: the scale is by the board's paper, of the kind that the manifest names.",
            "Nothing, if that error is small enough; else put a patch of known reflectance beside the sample.",
        ),
        Entry(
            "patches-not-used",
            "White patches could not be read in some photos, for the reason that is said.",
            "Neither patch nor sample may clip, nor lie in shadow.",
        ),
        Entry(
            "patches-contradict",
            "White patches contradict one another in most photos; the brightest for its reflectance is believed.",
            "A `reflectance` is wrong, or something lies on one.",
        ),
        Entry(
            "patch-not-believed",
            "A photo's white patch contradicts the board's paper, or makes it whiter than white.",
            "See whether it lies in shadow; check `reflectance`.",
            sigmas=4.0,
            source="of the photos' scatter, or 1 % where that is more",
        ),
        Entry(
            "paper-unsharp",
            "A photo's paper is darker beside the patch than in the others, and its black print lighter: "
            "out of focus, or "
            "shaken. Its paper does not tell the lamp's strength.",
            "Nothing.",
            sigmas=4.0,
            source="of the photos' scatter, or 1 % where that is more",
        ),
        Entry(
            "patch-and-paper-scatter",
            "The white patch is not always as bright beside the board's paper.",
            '`encoding` in the manifest is not that of the files (JPEG, and PNG of 8 bits, mostly are `"srgb"`); or '
            "the paper is glossy or bent: print on matte paper, glue it down.",
            least=0.025,
            source="relative; path-traced sets in order have 0.003 to 0.01, with a wrong encoding 0.04 and more",
        ),
        Entry(
            "lamps-unmeasured",
            "Neither patch nor paper can be read in any photo: all lamps are taken as equally strong.",
            "Expose so that the patch does not clip.",
        ),
        Entry(
            "lamp-taken-as-others",
            "Neither patch nor paper can be read in one photo: its lamp is taken to be as strong as the others.",
            "Nothing, if one lamp was used.",
        ),
    ),
}


def looked_at(stage: Stage) -> tuple[LookDeparture, ...]:
    """The departures of one stage before there is a camera, in order."""
    return tuple(one for one in LOOKS if one.stage is stage)


def asked_at(stage: Stage) -> tuple[Departure, ...]:
    """The departures of one stage, in order."""
    return tuple(one for one in DEPARTURES if one.stage is stage)


def entries(*stages: Stage) -> tuple[Entry, ...]:
    """All that may be told at some stages."""
    found: list[Entry] = []
    for stage in stages:
        found += [entry for look in looked_at(stage) for entry in look.entries]
        found += [entry for one in asked_at(stage) for entry in one.entries]
        found += TOLD.get(stage, ())
    return tuple(found)
