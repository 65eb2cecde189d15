"""Any BRDF that a file holds, ready to be compared: coefficients, truth, MERL, a grid or a table."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.files.arrays import read_arrays
from photogonio.capture.files.documents import read_json
from photogonio.capture.manifest.draft import PICTURES
from photogonio.capture.manifest.schema import array
from photogonio.capture.photoset import MANIFEST
from photogonio.compare.colours import rendered
from photogonio.compare.known import Known
from photogonio.compare.metrics import Directions
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.brdf.covariance_file import COEFFICIENTS
from photogonio.reconstruct.brdf.merl import CHANNELS
from photogonio.reconstruct.goniometer.foreign import known_everywhere
from photogonio.reconstruct.goniometer.pabopto import beginning, is_pabopto
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.goniometer.told import UNTOLD, Told
from photogonio.reconstruct.modes.angles import spherical_angles, unit_vectors
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.gridded import between, between_rows, of_one_rotation
from photogonio.reconstruct.table.table_file import load_table
from photogonio.synthetic.brdf.files import check_values, grid_arrays
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.render.world import brdf_from
from photogonio.synthetic.write.truth import FORMAT as TRUTH_FORMAT

# what process and calibrate write that holds no BRDF itself
BESIDE = ("setup.json", "report.html", *PICTURES)
TABLE = "table.npz"  # that they were fitted to
LUMINANCE = ("Y",)  # channels of Radiance's and pab-opto's files without colour
MEANT = ("quantity", "symmetry", "scale")  # keys of coefficients without which their numbers are guessed
MOST_NAMED = 5  # results of a folder


def find_brdf(path: Path, *, everywhere: bool = False) -> Path:
    """The file itself, or the coefficients or the truth in a folder; of a result's setup, report or picture, the
    coefficients beside it, and of its table too where f must be known ``everywhere``; of a manifest the truth.

    Raises:
        InputError: the folder holds several results, or nothing that holds a BRDF; so does a manifest's.
    """
    if path.name == MANIFEST and path.is_file():
        truth = path.with_name("truth.json")
        if not truth.is_file():
            raise InputError(path, "names the photos of a set, and holds no BRDF; process its folder first")
        return truth
    if not path.is_dir():
        beside = path.with_name(COEFFICIENTS)
        at_hand: tuple[str, ...] = (*BESIDE, TABLE) if everywhere else BESIDE
        return beside if path.name in at_hand and path.is_file() and beside.is_file() else path
    inside = (path / name for name in (COEFFICIENTS, "truth.json"))
    found = next((file for file in inside if file.is_file()), None)
    if found is None:
        several = sorted(file.parent.name for file in path.glob(f"*/{COEFFICIENTS}"))
        if several:
            more = ", ..." if len(several) > MOST_NAMED else ""
            names = ", ".join(several[:MOST_NAMED]) + more
            raise InputError(path, f"holds {len(several)} results; name one of them: {names}")
        if not any(is_pabopto(beginning(file)) for file in path.iterdir() if file.is_file()):
            raise InputError(
                path, f"holds no result of process or fit ({COEFFICIENTS}), and no set's truth.json"
            )
    return found or path


def load_known(path: Path, told: Told = UNTOLD) -> Known:
    """Read a BRDF: coefficients or truth (.json), MERL (.binary), BSDF XML, a grid (.npz), or a table: text, or
    pab-opto's files.

    ``told`` says how a table is read (:func:`reconstruct.goniometer.read.read_samples`).

    Raises:
        InputError: no such file, or none of these.
    """
    if not path.exists():
        raise InputError(path, "no such file; expected a BRDF (.json, .binary, .xml, .npz or a table)")
    read = _reader_of(path) if path.suffix in _READERS else None
    if read is not None:
        return read(path)
    known = known_everywhere(path)
    if known is not None:
        return Known(
            path.name,
            known.channels,
            isotropic=known.isotropic,
            evaluate=known.evaluate,
            luminance=known.channels == LUMINANCE,
        )
    read = _reader_of(path)
    return _read_table(path, told) if read is None else read(path)


def _reader_of(path: Path) -> Callable[[Path], Known] | None:
    """Of a file that is called, or else begins, as JSON or arrays do; None of others."""
    if not path.is_file():
        return None
    start = beginning(path, 256).lstrip()
    arrays = start.startswith("PK\3\4") and ".npy" in start
    told = ".npz" if arrays else ".json" if start.startswith("{") else ""
    return _READERS.get(path.suffix.lower()) or _READERS.get(told)


def _read_json(path: Path) -> Known:
    document = read_json(path)
    if isinstance(document, dict) and document.get("format") == TRUTH_FORMAT:
        return _read_truth(path, document.get("brdf"))
    brdf = load_brdf(path)
    known = brdf.uncertainty
    told = tuple(
        f"{path.name}: does not say its {key}, which is taken to be {getattr(brdf, key)}"
        for key in MEANT
        if key not in document
    )
    if known is not None and known.missing is not None:
        told += (
            f"{path.name}: {known.missing.get('file')} is missing beside it: how sure f is cannot be told",
        )
    return Known(path.name, brdf.channels, isotropic=not brdf.turning, evaluate=brdf, warnings=told)


def _read_truth(path: Path, truth: object) -> Known:
    """A rendered set's truth: its model, or its grid where the model is a file that is not beside it."""
    grid, model = (_part(path, truth, name) for name in ("grid", "model"))
    value = array(None, None)(grid.get("values"), f"{path}: brdf grid values")
    channels = _names(value.shape[1])
    if "model" in model or _is_beside(path, model.get("file")):
        reflectance = brdf_from(model, path.parent, path, as_reflectance)

        def evaluate(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
            f = reflectance(incident, exit)
            if f.shape[-1] not in (1, len(channels)):
                raise InputError(path, f"its model has {f.shape[-1]} channels, its grid {len(channels)}")
            return np.broadcast_to(f, (*f.shape[:-1], len(channels)))

        return Known(path.name, channels, isotropic=reflectance.isotropic, evaluate=evaluate)
    names = ("theta_i", "theta_r", "dphi")
    axes = [np.radians(array(None)(grid.get(name), f"{path}: brdf grid {name}")) for name in names]
    if math.prod(map(len, axes)) != len(value):
        raise InputError(f"{path}: brdf grid values", f"{len(value)} rows are not as many as directions")
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    check_values(path, nodes, value)
    return _on_grid(path, nodes, value)


def _is_beside(path: Path, name: object) -> bool:
    """Whether ``name`` is that of a file beside ``path``."""
    try:
        return isinstance(name, str) and (path.parent / name).exists()
    except (OSError, ValueError):  # longer than names may be, or a NUL in it
        return False


def as_reflectance(path: Path) -> Reflectance:
    """A foreign file beside a truth, in a picture's colours."""
    return rendered(load_known(path))


def _part(path: Path, truth: object, name: str) -> dict:
    part = truth.get(name) if isinstance(truth, dict) else None
    if not isinstance(part, dict):
        raise InputError(f"{path}: brdf {name}", "expected a table")
    return part


def _read_facets(path: Path) -> Known:
    """A facet table that ``process`` left: its values at the cells' mean directions."""
    table = load_table(path)
    cells = cells_of(table)
    incident, exit = unit_vectors(cells.theta_i, cells.phi_i), unit_vectors(cells.theta_r, cells.phi_r)
    return Known(path.name, table.channels, isotropic=False, at=_at(incident, exit), value=cells.value)


def _read_grid(path: Path) -> Known:
    if "groups" in read_arrays(path, "a grid or a facet table"):
        return _read_facets(path)
    return _on_grid(path, *grid_arrays(path))


def _on_grid(path: Path, grid: np.ndarray, value: np.ndarray) -> Known:
    theta_i, theta_r, dphi = grid.T
    at = _at(unit_vectors(theta_i, np.zeros_like(dphi)), unit_vectors(theta_r, dphi))
    value = value.reshape(len(grid), -1)
    everywhere = between_rows(at.incident, at.exit, value)
    return Known(path.name, _names(value.shape[1]), True, everywhere, at, value)


def _read_table(path: Path, told: Told) -> Known:
    samples = read_samples(path, told)
    at = _at(samples.incident, samples.exit)
    said = tuple(f"{path.name}: {warning}" for warning in samples.warnings)
    one = of_one_rotation(samples.incident)
    everywhere = between(samples.incident, samples.exit, samples.value)
    y = samples.channels == LUMINANCE and (path.is_dir() or is_pabopto(beginning(path)))
    return Known(path.name, samples.channels, one, everywhere, at, samples.value, said, luminance=y)


def _at(incident: np.ndarray, exit: np.ndarray) -> Directions:
    """Given directions, each weighted as a node of an even grid of angles."""
    polar = [spherical_angles(v)[0] for v in (incident, exit)]
    return Directions(incident, exit, np.sin(polar[0]) * np.sin(polar[1]))


def _names(count: int) -> tuple[str, ...]:
    return CHANNELS if count == 3 else tuple(f"c{k}" for k in range(count))


_READERS = {".json": _read_json, ".npz": _read_grid}  # by what files are called
