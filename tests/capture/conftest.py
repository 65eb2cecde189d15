"""Photo sets on disk, as small as can be."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pytest

from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from tests.capture.small_sets import SHAPE
from tests.places import SHARED

HEAD = """format = 1
[sample]
shape = "sphere"
center = [0, 0, 0]
radius = 1
[camera]
matrix = [[100, 0, 20], [0, 100, 15], [0, 0, 1]]
rotation = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
translation = [0, 0, 10]
"""


def write_png(path: Path, codes: np.ndarray) -> None:
    """Integer codes (h, w, 3) in the order R, G, B, or (h, w, 1)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pixels = codes[..., ::-1] if codes.shape[2] == 3 else codes
    assert cv2.imwrite(str(path), np.ascontiguousarray(pixels))


def write_oiio(path: Path, pixels: np.ndarray, kind: str, **attributes: object) -> None:
    """Any file that OpenImageIO writes; attributes' names have ``__`` for a colon."""
    path.parent.mkdir(parents=True, exist_ok=True)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if pixels.shape[2] > 4:  # else the fourth is taken for alpha
        spec.alpha_channel = -1
        spec.channelnames = [f"band{k}" for k in range(pixels.shape[2])]
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    file = oiio.ImageOutput.create(str(path))
    assert file is not None and file.open(str(path), spec), oiio.geterror()
    assert file.write_image(pixels), file.geterror()
    file.close()


def write_manifest(folder: Path, photos: list[dict[str, object]], extra: str = "") -> Path:
    """A photoset.toml of a ball without a board; ``extra`` stands before the photos."""
    lines = [HEAD + extra]
    for photo in photos:
        entries = [
            f"{k} = {f'{v!r}' if not isinstance(v, str) else chr(34) + v + chr(34)}" for k, v in photo.items()
        ]
        lines.append("[[photo]]\n" + "\n".join(entries))
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "photoset.toml").write_text("\n".join(lines), encoding="utf-8")
    return folder


@pytest.fixture(scope="session")
def files() -> dict[str, Callable[..., None]]:
    """Writers of photos and manifests."""
    return {"png": write_png, "oiio": write_oiio, "manifest": write_manifest}


@pytest.fixture(scope="session")
def shared() -> Path:
    folder = SHARED
    if not folder.is_dir():
        pytest.skip("the real data (../shared) is not here")
    return folder


def expose(light: np.ndarray, *, electrons: float = 20000.0, read: float = 5.0, seed: int = 0) -> np.ndarray:
    """What a sensor with photon and read noise makes of light, as a fraction of its full well; cut off at 0
    and 1.
    """
    rng = np.random.default_rng(seed)
    found = rng.poisson(np.clip(light, 0, 2) * electrons) + rng.normal(0, read, light.shape)
    return np.clip(found / electrons, 0, 1)


@pytest.fixture(scope="session")
def sensor() -> Callable[..., np.ndarray]:
    return expose


@pytest.fixture
def light() -> np.ndarray:
    """Smooth light, dark to bright, of three colours."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    ground = 0.02 + 0.5 * (x / SHAPE[1]) * (0.4 + 0.6 * y / SHAPE[0])
    return ground[..., None] * [1.0, 0.8, 0.5]


@pytest.fixture
def make(tmp_path, files):
    """Writes a set of (name, role, codes or pixels, further keys) and prepares its reader."""

    def build(photos, extra="", full=65535, camera=None, kind="float"):
        entries = []
        for name, role, signal, keys in photos:
            if name.endswith("exr"):
                files["oiio"](tmp_path / name, signal.astype(np.float32), kind)
            elif signal is not None:
                codes = np.round(np.clip(signal, 0, 1) * full)
                files["png"](tmp_path / name, codes.astype(np.uint16 if full > 255 else np.uint8))
            entries.append({"file": name, "role": role, **keys})
        photoset = load_photoset(files["manifest"](tmp_path, entries, extra))
        return photoset, prepare(photoset, camera=camera)

    return build
