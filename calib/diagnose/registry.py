"""All that calibration may tell, by code, in the order in which it is asked (docs/diagnoses.md)."""

from __future__ import annotations

from photogonio.capture.diagnosis import Entry

MANIFEST = (
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
        "markers-misplaced",
        "The markers lie beside where the board's numbers put them, by the same in several photos: corners are placed "
        "by the squares alone.",
        "Print the board anew with its markers in the middle of their squares, or correct `marker_length`.",
    ),
    Entry(
        "marker-corner-order",
        "The corners of loose markers are listed in another order than that of OpenCV's drawing; they are taken as the "
        "photos show them. AprilTags as their makers print them stand half a turn from OpenCV's.",
        "Nothing, or list them clockwise from the drawing's top left.",
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
    Entry(
        "sample-outside-picture",
        "The sample lies outside a photo, which is left out.",
        "If it does not: correct the sample's place in the manifest, or the unit of its lengths.",
    ),
    Entry(
        "camera-moved",
        "The camera or the board was bumped: the board lies elsewhere in a photo than where a fixed camera sees it in "
        "the others. That photo has a pose of its own.",
        "Nothing.",
        least=1.0,
        source="pixels; a judgement",
    ),
    Entry(
        "few-camera-photos",
        "Few photos tell the camera.",
        "Take eight or more of the board, or give `[camera]`.",
    ),
    Entry(
        "frontal-photos",
        "All photos that tell the camera are frontal: its focal length is as good as unknown.",
        "Tilt the board by 30 to 45 degrees.",
    ),
    Entry(
        "tilted-alike",
        "The board is tilted alike in all photos that tell the camera.",
        "Tilt it in different directions.",
    ),
    Entry(
        "corners-in-middle",
        "No corner of the board lies in the outer third of any picture: the lens's distortion there is a guess.",
        "Let the board reach into the corners of the picture in some photos.",
    ),
    Entry(
        "board-rows",
        "Markers are missing in all photos, or seen, as of a board of fewer or more rows than the manifest's: its "
        "origin lies elsewhere then, and all places are off by as much.",
        "Correct `board.squares`, or `board.markers`.",
    ),
    Entry(
        "board-stretched",
        "The board is taller or wider than the manifest says.",
        "Print at 100 %, measure both directions, and correct `square_length`.",
        least=0.002,
        sigmas=6.0,
        source="relative; a judgement",
    ),
    Entry(
        "board-bent",
        "The board is not flat.",
        "Fix it to a plate.",
        least=0.002,
        sigmas=6.0,
        source="of its size; a judgement",
    ),
)
PHOTO = (
    Entry(
        "outline-off-sample",
        "The board's print is seen within the flat sample's outline: the sample is taken to be what is left of it.",
        "Correct `sample.outline`.",
    ),
    Entry(
        "displaced-ball",
        "The sample ball's limb is seen elsewhere than the manifest has it; the ball is taken to be there.",
        "Correct `sample.center`, and `sample.radius` if it is said to be half as large.",
    ),
    Entry("dark-photo", "No light is on the board in a photo; it is left out.", "Nothing."),
    Entry(
        "unsharp-print",
        "Black print is much brighter beside white in a photo than in the others: out of focus, shaken, light on the "
        "lens, or the lamp was off. It is left out.",
        "Nothing, if there are enough others.",
    ),
    Entry(
        "print-contradicts-encoding",
        "Black print, as a share of the white, and how white grows with the light on it, are those of pictures whose "
        "codes were read by another curve than they have.",
        "Set `[radiometry] encoding` as it is said, and see what wrote the files; if the ink is no ordinary black, and "
        "nothing else is told, nothing.",
        least=0.15,
        sigmas=2.0,
        source="by which the power of growth differs from 1; drawn sets with balls that stand beside their places",
    ),
    Entry(
        "glossy-print",
        "Black print is no even share of the white beside it: toner, or paper, that mirrors the lamp, or light that "
        "spreads in the lens. Lamps are found by the white alone, less surely, which is in the stated errors.",
        "Print on matte paper, without toner; clean the lens.",
    ),
    Entry(
        "veiling-glare",
        "Light lies over whole pictures, as much on black print as on white: the lens's glare, or a black level that "
        "is not the sensor's. Black print against the white beside it tells it where the board is lit unevenly, "
        "and it is taken off; lamps far away, without shadows on the print, leave up to 0.2 % of white "
        "untold, as an error.",
        "Keep lamps and bright table tops out of the picture and off the lens, clean the lens, and check "
        "`black_level`.",
        least=1e-3,
        sigmas=4.0,
        source="of white paper; path-traced sets without a veil show 1e-4 to 4e-4 in single photos",
    ),
    Entry(
        "lamp-in-several-places",
        "Photos of one light show it in several places: each is taken as a light of its own where that can be told.",
        "Give each place of a lamp an `id` of its own.",
        least=0.0873,
        sigmas=4.0,
        source="radians; a judgement",
    ),
)
LIGHT = (
    Entry(
        "lamp-beam",
        "The lamps do not shine alike in all directions: a panel, a spot or a shade. Allowed for as a cosine's power "
        "beside the way to the sample.",
        "Turn such a lamp toward the sample in every photo.",
        least=0.2,
        sigmas=5.0,
        source="the power; 0.2 of it changes a patch's light by half a per cent",
    ),
    Entry(
        "vignetting",
        "The lens darkens the corners of its pictures. The paper of all photos together tells it, and it is divided "
        "out.",
        "Photos of an even field (role `flat`) tell it better, also where no board is; stop down.",
        least=0.02,
        sigmas=6.0,
        source="of the light in the corners; a judgement",
    ),
    Entry(
        "dark-corners",
        "The paper is darker toward the pictures' corners, but a lens that darkens them does not explain it: it is "
        "not allowed for.",
        'Take photos of an even field and say `vignetting = "flat"`.',
        least=0.02,
        sigmas=6.0,
        source="as for vignetting",
    ),
    Entry(
        "ambient-light",
        "Something besides the lamp lights the board. Allowed for as an even sky of the lamp's colour, which a window "
        "is not.",
        "Darken the room, or take a photo with the lamp off from the same place, role `ambient`.",
        least=0.015,
        sigmas=5.0,
        source="of the lamp's light; a judgement",
    ),
    Entry(
        "lamp-not-believed",
        "A photo's lamp was not found, or its mirror balls contradict one another, or the white patch shows another "
        "falloff than that lamp's. It is left out.",
        "See that the balls are not cut off, in shadow, or elsewhere than the manifest says.",
    ),
)
STRENGTH = (
    Entry(
        "moved-in-bracket",
        "Something moved between the exposures of a bracket; that part of the sample's picture is not used.",
        "Nothing, if it is a small part.",
        least=0.01,
        source="of the sample's part of the picture; a judgement",
    ),
    Entry(
        "patches-uneven",
        "No white patch is evenly lit in any photo: the scale is by those that are not, and as unsure as is said.",
        "Move the patch out of shadows, reflections and the beam's edge, or use a lamp without a reflector.",
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
        "A photo's paper is darker beside the patch than in the others, and its black print lighter: out of focus, or "
        "shaken. Its paper does not tell the lamp's strength.",
        "Nothing.",
        sigmas=4.0,
        source="of the photos' scatter, or 1 % where that is more",
    ),
    Entry(
        "patch-and-paper-scatter",
        "The white patch is not always as bright beside the board's paper.",
        '`encoding` in the manifest is not that of the files (JPEG, and PNG of 8 bits, mostly are `"srgb"`); or the '
        "paper is glossy or bent: print on matte paper, glue it down.",
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
    Entry(
        "one-mirror-ball",
        "Lamps are seen in one mirror ball only, so put as far away as the others.",
        "Let two polished balls show every lamp.",
    ),
    Entry(
        "sample-moved",
        "The sample ball stands a little off the manifest's centre; this is allowed for.",
        "Correct `sample.center`.",
        least=0.03,
        source="of its radius; a judgement",
    ),
    Entry(
        "sample-not-believed",
        "The sample ball seems to stand farther off than anybody can mistake; the manifest's place is kept.",
        "Check `sample.center` and `sample.radius`, and with a ruler whether the board's squares are as long as the "
        "manifest says.",
    ),
    Entry(
        "flat-sample-not-believed",
        "The flat sample's edges are not where the manifest puts them, by too much to be believed.",
        "Check `sample.outline` and `sample.height`.",
    ),
    Entry(
        "flat-sample-tilted",
        "The flat sample is tilted against the board, and taken as level.",
        "Lay it flat.",
        least=0.0122,
        sigmas=5.0,
        source="radians; a judgement",
    ),
    Entry(
        "flat-sample-moved",
        "The flat sample lies beside its outline; this is allowed for.",
        "Correct `outline`.",
    ),
    Entry(
        "flat-sample-size",
        "The flat sample is larger or smaller than its outline; this is allowed for.",
        "Correct `sample.outline`.",
    ),
    Entry("mirror-ball-moved", "A mirror ball seems to stand elsewhere.", "Check its `center` and `radius`."),
    Entry(
        "mirror-ball-contradicts",
        "A mirror ball's highlights miss the lamps that the others show.",
        "Check its `center` and `radius`, and whether it moved between photos.",
    ),
    Entry(
        "balls-and-paper-contradict",
        "What the mirror balls show and how the paper is lit contradict each other: lights are uncertain.",
        'The lens darkens its corners: stop down, or take `flat` photos and say `vignetting = "flat"`. Or a polished '
        "ball is not where the manifest says.",
        least=3.0,
        source="times their errors; path-traced sets have 0.4 to 1.2",
    ),
)
ENTRIES = (*MANIFEST, *PHOTO, *LIGHT, *STRENGTH)
