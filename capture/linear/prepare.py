"""A first look at a photo set: sizes, exposures, clipping, noise, dark, flat and ambient frames."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.files.exposure import Exposure, combine, filled, stepped
from photogonio.capture.files.images import Header, Image, read_header, read_image
from photogonio.capture.linear import told
from photogonio.capture.linear.clipping import clip_code
from photogonio.capture.linear.corrections import ambient_light, dark_frame, flat_field, vignetting
from photogonio.capture.linear.encoding import Encoding
from photogonio.capture.linear.frames import Rays
from photogonio.capture.linear.noise import NoiseModel, estimate_noise, given_noise
from photogonio.capture.linear.reader import RadianceReader
from photogonio.capture.linear.response import Series, recover_response
from photogonio.capture.linear.signal import Sensor, grown, linear_signal, saturated, widened
from photogonio.capture.photoset import MANIFEST, PhotoSet, View

LOOKED_AT = 4  # photos, for noise and clipping
AT_ONCE = 2  # of them are decoded, which releases the interpreter
BAND = 64  # rows
LOOKED_AT_PIXELS = 1_500_000  # of a photo, in evenly spaced bands of rows
SERIES = 3  # brackets that a response curve is recovered from
ASSUMED_ELECTRONS = 20000.0  # at white level, where no photo tells
ASSUMED_READ = 5.0
NAMED = 4  # photos in a warning


def prepare(
    photoset: PhotoSet,
    *,
    camera: Rays | None = None,
    decode: Callable[..., Image] = read_image,
    tone: np.ndarray | None = None,
) -> RadianceReader:
    """A reader for a set. ``camera`` (its ``rays`` and ``size``) is needed for ``vignetting = "cos4"`` only;
    ``decode`` is what photos are read with. ``tone`` (n, c): light of evenly spaced codes, where it is unknown and no
    bracket tells it; without it they are then read as sRGB, for a first look.

    Raises InputError if no photo can be read, if photos differ in size, or if dark, flat or ambient frames
    cannot be used. A single unreadable photo is left for :meth:`RadianceReader.read` to name.
    """
    headers = read_headers(photoset)
    size = common_size(photoset, headers)
    images = look(photoset, decode)
    check_channels(photoset, len(images[0].channels))
    exposures = {
        photo.file: combine(photo, headers[photo.file].exposure if photo.file in headers else Exposure())
        for photo in photoset.photos
    }
    exposures, steps = stepped(exposures)
    exposures, assumed = with_missing(photoset, exposures)
    loose = () if cancels(photoset) else steps
    counted = [photo for view in photoset.views("sample") for photo in view.photos] or photoset.photos
    fields = frozenset().union(*(exposures[photo.file].known() for photo in counted))
    encoding, notes = encoding_of(photoset, images[0], exposures, tone)
    sensor = sensor_of(photoset, images, encoding)
    reader = RadianceReader(
        photoset=photoset,
        channels=images[0].channels,
        size=size,
        sensor=sensor,
        exposures=exposures,
        fields=fields,
        notes=(*notes, *(() if loose else steps), *told.notes(photoset, headers), sensor_note(sensor)),
        diagnoses=(
            *assumed,
            *(Diagnosis("exposure-steps", line, allowed=True) for line in loose),
            *told.doubts(photoset, headers),
            *doubts(photoset, images[0], sensor),
        ),
        decode=decode,
    )
    dark, unread = dark_frame(reader)
    reader = replace(reader, dark=dark, diagnoses=reader.diagnoses + unread)
    ambient, unread = ambient_light(reader)
    reader = replace(reader, ambient=ambient, diagnoses=reader.diagnoses + unread)
    flat, unread = flat_field(reader)
    gain = vignetting(reader, camera) if flat is None else flat
    return replace(reader, gain=gain, diagnoses=reader.diagnoses + unread)


def check_channels(photoset: PhotoSet, channels: int) -> None:
    """Raise InputError for a key of the manifest that has one number a channel, and not as many as the photos."""
    given = [
        (f"white_patch[{k}] reflectance", one.reflectance) for k, one in enumerate(photoset.white_patches)
    ]
    given += [(f"light[{k}] intensity", light.intensity) for k, light in enumerate(photoset.lights)]
    for key, numbers in given:
        if len(numbers) not in (1, channels):
            expected = f"one number, or {channels} (one for each channel of the photos)"
            raise InputError(
                f"{photoset.folder / MANIFEST}: {key}", f"expected {expected}, found {len(numbers)}"
            )


def cancels(photoset: PhotoSet) -> bool:
    """Whether a white patch or a board's paper tells the lamp's strength in each photo and nothing is subtracted, so
    that exposures hardly count."""
    subtracted = any(photo.role in ("dark", "ambient") for photo in photoset.photos)
    return not subtracted and (photoset.board is not None or bool(photoset.white_patches))


def with_missing(
    photoset: PhotoSet, exposures: Mapping[str, Exposure]
) -> tuple[dict[str, Exposure], tuple[Diagnosis, ...]]:
    """Exposures with those that some photos of the sample lack, where a white patch or a board's paper tells the lamp's
    strength in each photo and nothing is subtracted, so that they hardly count; and what is to be said of them."""
    if not cancels(photoset):
        return dict(exposures), ()
    sample = [photo for photo in photoset.photos if photo.role in ("sample", "probe")]
    found, lacking = filled(exposures, sample)
    return found, tuple(
        Diagnosis(
            "exposure-assumed",
            f"no {field}, neither in the manifest nor in EXIF, in {len(files)} of {len(sample)} photos "
            f"({', '.join(files[:NAMED])}{', ...' if len(files) > NAMED else ''}): taken as the others', which counts "
            "only where neither white patch nor paper can be read",
            amount=len(files),
            views=tuple(files),
        )
        for field, files in lacking.items()
    )


def read_headers(photoset: PhotoSet) -> dict[str, Header]:
    """Headers by file, without those that cannot be read."""
    headers: dict[str, Header] = {}
    first: InputError | None = None
    for photo in photoset.photos:
        try:
            path = photoset.folder / photo.file
            headers[photo.file] = read_header(path, demosaic=photoset.radiometry.demosaic)
        except InputError as error:
            first = first or error
    if first is not None and not headers:
        raise first
    return headers


def common_size(photoset: PhotoSet, headers: Mapping[str, Header]) -> tuple[int, int]:
    """Width and height of all photos. Raises InputError naming the first that differs from most."""
    size, _ = Counter(header.size for header in headers.values()).most_common(1)[0]
    for file, header in headers.items():
        if header.size != size:
            found, expected = ("{} x {}".format(*which) for which in (header.size, size))
            raise InputError(photoset.folder / file, f"is {found} pixels, the other photos are {expected}")
    return size


def look(photoset: PhotoSet, decode: Callable[..., Image] = read_image) -> list[Image]:
    """A few readable photos of the sample, evenly spread; of a bracket the middle one."""
    views = photoset.views("sample") or tuple(View((photo,)) for photo in photoset.photos)
    chosen = {round(k) for k in np.linspace(0, len(views) - 1, min(LOOKED_AT, len(views)))}
    order = [*sorted(chosen), *(k for k in range(len(views)) if k not in chosen)]

    def attempt(k: int) -> Image | InputError:
        photo = views[k].photos[len(views[k].photos) // 2]
        try:
            return bands(decode(photoset.folder / photo.file, demosaic=photoset.radiometry.demosaic))
        except InputError as error:
            return error

    with ThreadPoolExecutor(AT_ONCE) as pool:
        found = list(pool.map(attempt, order[: len(chosen)]))
    for k in order[len(chosen) :]:  # in place of those that cannot be read
        if sum(isinstance(one, Image) for one in found) == len(chosen):
            break
        found.append(attempt(k))
    images = [one for one in found if isinstance(one, Image)]
    if not images:
        errors = [one for one in found if isinstance(one, InputError)]
        raise errors[0] if errors else InputError(photoset.folder, "no photo can be read")
    same = [image for image in images if image.pixels.shape == images[0].pixels.shape]
    return [image for image in same if image.pixels.dtype == images[0].pixels.dtype]


def bands(image: Image) -> Image:
    """A large photo thinned out to evenly spaced bands of rows, half floats widened."""
    height, width = image.pixels.shape[:2]
    step = max(1, round(height * width / LOOKED_AT_PIXELS))
    rows = np.arange(height)[(np.arange(height) // BAND) % step == 0]
    if len(rows) == height:
        return replace(image, pixels=widened(image.pixels))
    full = None if image.saturated is None else image.saturated[rows]
    return replace(image, pixels=widened(image.pixels[rows]), saturated=full)


def sensor_of(photoset: PhotoSet, images: Sequence[Image], encoding: Encoding) -> Sensor:
    """How codes stand for light, where they clip, and how noisy they are."""
    radiometry, image = photoset.radiometry, images[0]
    own_levels = radiometry.black_level is not None or radiometry.white_level is not None
    clip = clip_code([image.pixels for image in images], image.full_scale, lossy=image.lossy)
    if radiometry.white_level is not None:
        clip = min(clip, encoding.white * (image.full_scale + image.black) - image.black)
    noise = given_noise(radiometry, len(image.channels), image.sites)
    sensor = Sensor(encoding, noise or assumed_noise(len(image.channels)), clip, own_levels, image.full_scale)
    return sensor if noise else replace(sensor, noise=noise_of(sensor, images))


def doubts(photoset: PhotoSet, image: Image, sensor: Sensor) -> tuple[Diagnosis, ...]:
    """What may be wrong with the set and cannot be told from it."""
    found = []
    if image.lossy and sensor.encoding.kind == "linear" and not image.tone.told:
        found.append(
            Diagnosis(
                "jpeg-as-linear",
                'the photos are JPEG and read as linear; set [radiometry] encoding = "srgb" if a camera wrote them',
            )
        )
    loose = any(photo.role == "ambient" and photo.light is None for photo in photoset.photos)
    still = photoset.camera.fixed or photoset.camera.rotation is not None
    if loose and not still and len(photoset.views("sample")) > 1:
        found.append(
            Diagnosis(
                "ambient-camera-moved",
                "ambient photos name no light and [camera] fixed is not set: they are subtracted from all photos"
                " as if the camera had not moved",
            )
        )
    if sensor.noise.source == "assumed":
        found.append(
            Diagnosis(
                "noise-assumed",
                "the photos are too small or too full to measure their noise; a usual one is assumed",
            )
        )
    return tuple(found)


def sensor_note(sensor: Sensor) -> str:
    """What was found of the noise, in words."""
    noise = sensor.noise
    slope, read = float(np.mean(noise.slope)), float(np.sqrt(np.mean(noise.read)))
    if slope == 0 and read == 0:
        return f"noise {noise.source}: less than the quantisation of the files"
    full = f"{1 / slope:.3g} electrons at white level, " if slope > 0 else ""
    return f"noise {noise.source}: {full}read noise {read:.2g} of white level"


def encoding_of(
    photoset: PhotoSet, image: Image, exposures: Mapping[str, Exposure], tone: np.ndarray | None = None
) -> tuple[Encoding, tuple[str, ...]]:
    """The encoding, as given or recovered from the brackets, and what there is to say of it; ``tone`` is the table
    (n, c) where the print told it."""
    radiometry = photoset.radiometry
    where = f"{photoset.folder / MANIFEST}: [radiometry] encoding"
    if image.raw and radiometry.encoding not in ("linear", "auto"):
        raise InputError(where, f'a RAW photo is "linear", not "{radiometry.encoding}"')
    file_black = image.black / (image.full_scale + image.black)
    black = radiometry.black_level if radiometry.black_level is not None else file_black
    white = radiometry.white_level if radiometry.white_level is not None else 1.0
    if radiometry.encoding == "auto":
        return Encoding("linear" if image.raw else "file", 1.0, black, white), ()
    if radiometry.encoding != "unknown":
        return Encoding(radiometry.encoding, radiometry.gamma or 1.0, black, white), ()
    if untold_by_brackets(photoset):
        if image.pixels.dtype.kind != "u":
            raise InputError(where, "the print tells the curve of photos of 8 or 16 bit integers only")
        told = Encoding("srgb", 1.0, black, white)
        return (told if tone is None else replace(told, kind="table", table=tone)), ()
    try:
        response = recover_response(exposure_series(photoset, exposures))
    except ValueError as error:
        raise InputError(where, f"the response cannot be recovered: {error}") from error
    note = f"response recovered from brackets ({response.method}), predicts exposures to {response.error:.2%}"
    return Encoding("table", 1.0, black, white, response.table), (note,)


def untold_by_brackets(photoset: PhotoSet) -> bool:
    """Whether the tone curve is unknown, and no bracket there to tell it."""
    return photoset.radiometry.encoding == "unknown" and all(
        photo.bracket is None for photo in photoset.photos
    )


def exposure_series(photoset: PhotoSet, exposures: Mapping[str, Exposure]) -> list[Series]:
    """Up to SERIES brackets as 8-bit codes, thinned out."""
    series: list[Series] = []
    for role in ("sample", "probe", "calibration"):
        for view in photoset.views(role):
            if len(view.photos) > 1 and len(series) < SERIES:
                images = [bands(read_image(photoset.folder / photo.file)) for photo in view.photos]
                if any(image.pixels.dtype.kind != "u" for image in images):
                    raise ValueError("expected photos of 8 or 16 bit integers")
                codes = tuple(
                    np.round(image.pixels * (255.0 / image.full_scale)).astype(np.uint8) for image in images
                )
                factors = tuple(exposures[photo.file].factor for photo in view.photos)
                series.append(Series(codes, factors))
    return series


def assumed_noise(channels: int) -> NoiseModel:
    read = np.full(channels, (ASSUMED_READ / ASSUMED_ELECTRONS) ** 2)
    return NoiseModel(read, np.full(channels, 1 / ASSUMED_ELECTRONS), "assumed")


def noise_of(sensor: Sensor, images: Sequence[Image]) -> NoiseModel:
    """Estimated from the photos; assumed where they are too small or too full to tell."""

    def signal(image: Image) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        value, quantisation = linear_signal(image, image.pixels, sensor)
        usable = ~grown(saturated(image.pixels, sensor.clip, image.saturated))
        if image.pixels.dtype.kind == "u":
            for c in range(image.pixels.shape[2]):
                usable &= image.pixels[..., c] > 0  # cut off at 0, noise looks smaller
        return value, np.broadcast_to(quantisation, value.shape), usable

    with ThreadPoolExecutor(AT_ONCE) as pool:
        photos = list(pool.map(signal, images))
    return estimate_noise(photos) or assumed_noise(len(images[0].channels))
