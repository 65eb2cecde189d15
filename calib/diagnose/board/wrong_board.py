"""Why a board is not found that is there: its markers are others, or laid out otherwise, than the manifest says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np

from photogonio.calib.detect.first_look import FirstLook
from photogonio.calib.detect.gray import detection_image, without_fireflies
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.diagnose.base import LookDeparture, Stage
from photogonio.calib.geometry.board import Corners, dictionary, opencv_board
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST, Board, CharucoBoard, GridBoard, LooseMarkers, PrintedBoard

_FEWEST = 6  # markers that tell how they are laid out: any four fit some homography
_LOOKED_AT = 3  # photos
_OFF = 0.15  # of a marker's side, that it may lie beside its place: a lens bends a board by less
_FIT = 0.8  # share of the markers that must lie where a board has them
_ALL = 0.97  # share of them that is all but what is misread
_WIDER = 0.1  # relative, by which markers of a grid may be wider beside their distances
_COLUMNS = range(2, 31)
_ROWS = 3  # that a manifest may miscount
_IN_PICTURE = 1.0  # sides of a marker, that its middle lies inside the picture's border
_UPRIGHT = 5  # loose markers that tell which way up they are: any four fit a homography
_ELSEWHERE = 0.5  # of a loose marker's side, that it lies beside its place
_BESIDE_OTHERS = 5.0  # times as far as the others do: a lens bends all of a sheet
_ALL_ELSEWHERE = 0.1  # of the way over the sheet, beyond any lens
_MIRRORED = (
    "board: the photos show the markers mirrored: print the board as it is drawn, not through a mirror, and give "
    "photos that are not flipped (orientation in the file, a mirror in the beam, a camera that faces its user)"
)
_NEGATIVE = (
    "board: the photos show the markers white on black: print the board black on white, and give positives"
)
_MIRROR_PLACES = (
    "board.marker: the photos show the mirror image of the places given: x goes to the right and y up the page, from "
    "its lower left"
)
# each holds the smaller ones of its kind
_LARGEST = (
    *(f"DICT_{n}X{n}_1000" for n in (4, 5, 6, 7)),
    "DICT_ARUCO_ORIGINAL",
    *(f"DICT_APRILTAG_{name}" for name in ("16H5", "25H9", "36H10", "36H11")),
    "DICT_ARUCO_MIP_36H12",
)


class WrongBoard(LookDeparture):
    """Nothing is made of a set whose photos show another board than its manifest says."""

    stage = Stage.LOOK
    entries = (
        Entry(
            "wrong-board",
            "The photos show markers of another dictionary than the manifest's, or laid out otherwise, mirrored or "
            "white on black, or loose ones elsewhere than given. Nothing is calibrated.",
            "Correct `[board]` as it is said, or print the board as it is drawn.",
            least=1 - _FIT,
            source="share of the markers that lie beside their places by 0.15 of their side",
        ),
    )

    def evidence(self, look: FirstLook) -> Sequence[Diagnosis]:
        board = look.photoset.board
        if board is None:
            return []
        fault = board_fault(board, look.reader, [one for one in look.photos.every if one.corners is not None])
        return [] if fault is None else [Diagnosis("wrong-board", fault)]

    def remedy(self, look: FirstLook, found: Sequence[Diagnosis]) -> FirstLook:
        raise InputError(look.photoset.folder / MANIFEST, found[0].message)


def board_fault(board: Board, reader: Reader, seen: list[Seen]) -> str | None:
    """What of the manifest's board the photos contradict, with what they show instead; None if nothing shows."""
    if not seen:
        return None
    order = sorted(seen, key=lambda one: -_markers(one.corners))
    few = _FEWEST
    if isinstance(
        board, LooseMarkers
    ):  # some may lie outside all pictures; few are taken for others by mishap
        few = max(1, min(_FEWEST, len(board.marker_corners) // 4))
    told = [one.corners for one in order if one.corners is not None and _of_board(board, one.corners) >= few]
    if not told:
        some = order[:: max(1, len(order) // _LOOKED_AT)][:_LOOKED_AT]
        return _other_look(board, reader, some) or _other_dictionary(board, reader, some)
    if isinstance(board, LooseMarkers):
        return _upside_down(board, told[0]) or _elsewhere(board, told)
    share, wider = max(_laid(board, corners) for corners in told)
    if share < _FIT:
        return _other_layout(board, told[0])
    if (
        isinstance(board, CharucoBoard) and share < _ALL
    ):  # of an odd number of columns old boards differ in one
        other = replace(board, legacy_pattern=not board.legacy_pattern)
        if max(_laid(other, corners)[0] for corners in told) >= _ALL:
            return _laid_out(_legacy_words(other), told[0])
    bare = [one for one in seen if one.view.photos[0].role == "calibration" and _markers(one.corners) >= few]
    rows = _more_rows(board, told) if share < _ALL else _fewer_rows(board, bare)
    if rows is not None:
        return rows
    if isinstance(board, GridBoard) and abs(wider - 1) > _WIDER:
        apart = board.marker_separation / board.marker_length
        shown = (1 + apart) / wider - 1
        return (
            f"board.marker_separation: the photos show markers {shown:.2g} of their length apart, marker_separation "
            f"and marker_length say {apart:.2g}"
        )
    return None


def _markers(corners: Corners | None) -> int:
    return 0 if corners is None else len(corners.marker_ids)


def _of_board(board: Board, corners: Corners | None) -> int:
    """Markers seen that the board has; of a printed board any may tell that it is another."""
    if corners is None or not isinstance(board, LooseMarkers):
        return _markers(corners)
    return int(np.isin(corners.marker_ids, [k for k, _ in board.marker_corners]).sum())


def _other_look(board: Board, reader: Reader, seen: list[Seen]) -> str | None:
    """What was done to a print of the right markers, in which none is recognized as it is."""
    ids = np.asarray(opencv_board(board).getIds()).ravel()
    detector = cv2.aruco.ArucoDetector(dictionary(board.dictionary), cv2.aruco.DetectorParameters())
    found: dict[str, set[int]] = {}
    for one in seen:
        shown = reader.level(one.view)
        if shown is None:
            continue
        image = detection_image(without_fireflies(shown[0]))
        for what, changed in ((_MIRRORED, image[:, ::-1]), (_NEGATIVE, 255 - image)):
            _, marks, _ = detector.detectMarkers(np.ascontiguousarray(changed))
            known = set() if marks is None else set(map(int, np.ravel(marks))) & set(ids.tolist())
            found.setdefault(what, set()).update(known)
    best = max(found, key=lambda one: len(found[one]), default=None)
    return best if best is not None and len(found[best]) >= min(_FEWEST, len(ids)) else None


def _upside_down(board: LooseMarkers, corners: Corners) -> str | None:
    """Whether places of loose markers are given with y down the page, so that the photos show their mirror image."""
    middles = {k: np.asarray(c, float).reshape(4, 3)[:, :2].mean(0) for k, c in board.marker_corners}
    known = np.array([int(k) in middles for k in corners.marker_ids], bool)
    if known.sum() < _UPRIGHT:
        return None
    flat = np.array([middles[int(k)] for k in corners.marker_ids[known]])
    quads = corners.marker_pixels[known]
    matrix, _ = cv2.findHomography(flat, quads.mean(1), cv2.RANSAC, _OFF * float(np.median(_sides(quads))))
    if matrix is None:
        return None
    # the camera's x and y turn the other way than the board's seen from its front: y down, against y up the page
    middle = np.append(flat.mean(0), 1.0)
    if np.linalg.det(matrix) / (matrix[2] @ middle) ** 3 < 0:
        return None
    off = np.linalg.norm(_mapped(matrix, flat) - quads.mean(1), axis=1)
    return _MIRROR_PLACES if np.mean(off < _OFF * _sides(quads).mean(1)) >= _FIT else None


def _elsewhere(board: LooseMarkers, told: Sequence[Corners]) -> str | None:
    """Whether flat loose markers lie elsewhere than given, as where ids are exchanged: told by their middles."""
    places = {k: np.asarray(c, float).reshape(4, 3) for k, c in board.marker_corners}
    middles = {k: quad[:, :2].mean(0) for k, quad in places.items() if np.ptp(quad[:, 2]) == 0 == quad[0, 2]}
    beside: dict[int, list[float]] = {}
    lost: list[bool] = []  # photos in which most lie elsewhere
    for corners in told:
        known = np.array([int(k) in middles for k in corners.marker_ids], bool)
        if known.sum() < _UPRIGHT:
            continue
        ids, seen = corners.marker_ids[known], corners.marker_pixels[known]
        flat, side = np.array([middles[int(k)] for k in ids]), _sides(seen).mean(1)
        matrix, _ = cv2.findHomography(flat, seen.mean(1), cv2.RANSAC, _ELSEWHERE * float(np.median(side)))
        if matrix is None:
            continue
        off = np.linalg.norm(_mapped(matrix, flat) - seen.mean(1), axis=1) / side
        wide = float(np.median(np.ptp(seen.mean(1), axis=0)) / np.median(side))
        lost.append(bool(np.median(off) > max(_ELSEWHERE, _ALL_ELSEWHERE * wide)))
        for number, far in zip(ids, off, strict=True):
            beside.setdefault(int(number), []).append(float(far))
    if not lost:
        return None
    far = {number: float(np.median(each)) for number, each in beside.items()}
    bound = max(_ELSEWHERE, _BESIDE_OTHERS * float(np.median(list(far.values()))))
    wrong = sorted(number for number, one in far.items() if one > bound)
    if 2 * sum(lost) > len(lost):
        return (
            "board.marker: most markers lie elsewhere than given: are their ids those of the print, x to the right, "
            "y up the page?"
        )
    if not wrong:
        return None
    whose = f"marker {wrong[0]} lies" if len(wrong) == 1 else f"markers {', '.join(map(str, wrong))} lie"
    return (
        f"board.marker: {whose} elsewhere than given, by {max(far[k] for k in wrong):.2g} of a marker's side, "
        "and the others where they are given: correct their corners or ids, or leave them out"
    )


def _other_dictionary(board: Board, reader: Reader, seen: list[Seen]) -> str | None:
    found: dict[str, set[int]] = {}
    for one in seen:
        shown = reader.level(one.view)
        if shown is None:
            continue
        image = detection_image(without_fireflies(shown[0]))
        for name in _LARGEST:
            detector = cv2.aruco.ArucoDetector(dictionary(name), cv2.aruco.DetectorParameters())
            _, marks, _ = detector.detectMarkers(image)
            found.setdefault(name, set()).update([] if marks is None else map(int, np.ravel(marks)))
    best = max(found, key=lambda one: len(found[one]), default=None)
    if best is None or len(found[best]) < _FEWEST:
        return None
    ids = sorted(found[best])
    if best.lower().startswith(board.dictionary.lower().rsplit("_", 1)[0]):
        return (
            f"board: the photos show markers {ids[0]} to {ids[-1]} of {board.dictionary} ({len(ids)} of them), and few "
            "or none of those that the manifest gives: correct their ids"
        )
    return (
        f"board.dictionary: the photos show markers of {best} or of a smaller one of its kind ({len(ids)} of them, "
        f"from {ids[0]} to {ids[-1]}), not of {board.dictionary}"
    )


def _more_rows(board: PrintedBoard, told: Sequence[Corners]) -> str | None:
    """Whether the print goes on below the board's last row: places are counted from there."""
    name, (columns, rows) = _size_of(board)
    for more in range(1, _ROWS + 1):
        taller = _of_size(board, (columns, rows + more))
        if max(_laid(taller, corners)[0] for corners in told) >= _ALL:
            return _laid_out(f"{name} = {[columns, rows + more]}, not {[columns, rows]}", told[0])
    return None


def _fewer_rows(board: PrintedBoard, bare: Sequence[Seen]) -> str | None:
    """Whether photos of the bare board show none of the last rows' markers, all of which lie in the pictures."""
    name, (columns, rows) = _size_of(board)
    for less in range(min(_ROWS, rows - 2), 0, -1):
        shorter = _of_size(board, (columns, rows - less))
        kept = np.asarray(opencv_board(shorter).getIds()).max() if less < rows else -1
        asked, seen = [], 0
        for one in bare:
            corners = one.corners
            matrix = None if corners is None else _matrix(board, corners)
            if corners is None or matrix is None:
                continue
            places = [quad.mean(0) for k, quad in _places(board).items() if k > kept]
            there = _mapped(matrix, np.array(places))
            margin = _IN_PICTURE * float(np.median(_sides(corners.marker_pixels)))
            inside = (there > margin).all(1) & (there < np.array(one.size) - 1 - margin).all(1)
            asked.append(int(inside.sum()))
            seen += bool((corners.marker_ids > kept).any())
        if np.count_nonzero(asked) >= 2 and sum(asked) >= _FEWEST and not seen:
            return (
                f"board.{name} = {[columns, rows]}: photos of the bare board show no marker of the last "
                f"{'row' if less == 1 else f'{less} rows'}, where {sum(asked)} should be: is it "
                f"{[columns, rows - less]}?"
            )
    return None


def _size_of(board: PrintedBoard) -> tuple[str, tuple[int, int]]:
    return ("squares", board.squares) if isinstance(board, CharucoBoard) else ("markers", board.markers)


def _other_layout(board: PrintedBoard, corners: Corners) -> str | None:
    for other, what in _others(board, corners):
        if _laid(other, corners)[0] >= _FIT:
            return _laid_out(what, corners)
    return None


def _laid_out(what: str, corners: Corners) -> str:
    ids = corners.marker_ids
    return f"board.{what}: the photos show markers {ids.min()} to {ids.max()} laid out so"


def _legacy_words(board: CharucoBoard) -> str:
    return f"legacy_pattern = {str(board.legacy_pattern).lower()}, squares = {list(board.squares)}"


def _others(board: PrintedBoard, corners: Corners) -> Iterator[tuple[PrintedBoard, str]]:
    """Boards that may have been meant, the likeliest first, and in what they differ."""
    charuco, ids = isinstance(board, CharucoBoard), corners.marker_ids
    name, size = _size_of(board)
    turned = _of_size(board, (size[1], size[0]))
    yield turned, f"{name} = {list(size[::-1])}, not {list(size)}"
    firsts = sorted({0, int(ids.min()), board.first_id})
    for first in firsts:
        yield replace(board, first_id=first), f"first_id = {first}, not {board.first_id}"
        yield replace(turned, first_id=first), f"{name} = {list(size[::-1])} and first_id = {first}"
    for one in (board, turned):
        if isinstance(one, CharucoBoard):
            other = replace(one, legacy_pattern=not one.legacy_pattern)
            yield other, _legacy_words(other)
    if charuco:  # before others of its kind: a grid is, aslant, one of twice as many columns and one
        yield from _of_other_kind(board, firsts, int(ids.max()))
    for first in firsts:
        for columns in _COLUMNS:
            count = int(ids.max()) - first + 1
            rows = max(2, -(-(2 if charuco else 1) * count // columns))
            for high in (rows, rows + 1) if charuco else (rows,):
                yield (
                    _of_size(replace(board, first_id=first), (columns, high)),
                    f"{name}: {columns} columns with first_id = {first}, not {list(size)} with {board.first_id}",
                )

    if not charuco:
        yield from _of_other_kind(board, firsts, int(ids.max()))


def _of_other_kind(
    board: PrintedBoard, firsts: Sequence[int], last: int
) -> Iterator[tuple[PrintedBoard, str]]:
    """Grids where a chessboard with markers was named, or the other way about, with markers up to ``last``."""
    for first in firsts:
        for columns in _COLUMNS:
            if isinstance(board, CharucoBoard):
                rows = max(1, -(-(last + 1 - first) // columns))
                grid = GridBoard(board.dictionary, (columns, rows), board.marker_length, board.gap, first)
                yield grid, f'kind = "aruco-grid" of {columns} columns, first_id = {first}, not "charuco"'
                continue
            rows = max(2, -(-2 * (last + 1 - first) // columns))
            for high in (rows, rows + 1):
                for legacy in (False, True):
                    size = (columns, high)
                    chess = CharucoBoard(
                        board.dictionary, size, board.pitch, board.marker_length, first, legacy
                    )
                    yield (
                        chess,
                        f'kind = "charuco" of {columns} columns, first_id = {first}, not "aruco-grid"',
                    )


def _of_size(board: PrintedBoard, size: tuple[int, int]) -> PrintedBoard:
    if isinstance(board, CharucoBoard):
        return replace(board, squares=size)
    return replace(board, markers=size)


def _laid(board: PrintedBoard, corners: Corners) -> tuple[float, float]:
    """Share of the markers seen whose middles lie where a board has them, by the homography that fits most; and how
    much wider they are than it says, as a factor."""
    try:
        place = _places(board)
    except InputError:
        return 0.0, 1.0
    known = np.array([int(k) in place for k in corners.marker_ids])
    if known.sum() < _FEWEST:
        return 0.0, 1.0
    flat = np.array([place[int(k)] for k in corners.marker_ids[known]])
    quads = corners.marker_pixels[known]
    bound = _OFF * float(np.median(_sides(quads)))
    matrix, _ = cv2.findHomography(flat.mean(axis=1), quads.mean(axis=1), cv2.RANSAC, bound)
    if matrix is None or abs(np.linalg.det(matrix)) < 1e-12:
        return 0.0, 1.0
    off = np.linalg.norm(_mapped(matrix, flat.mean(axis=1)) - quads.mean(axis=1), axis=1)
    there = _mapped(np.linalg.inv(matrix), quads.reshape(-1, 2)).reshape(-1, 4, 2)
    wider = float(np.median(_sides(there)[off < bound]) / board.marker_length) if (off < bound).any() else 1.0
    return float((off < bound).sum()) / len(corners.marker_ids), wider


def _places(board: PrintedBoard) -> dict[int, np.ndarray]:
    """Corners (4, 2) of each marker by id, in OpenCV's frame. Raises InputError for a board that cannot be."""
    made = opencv_board(board)
    quads = (np.asarray(p, float).reshape(4, 3)[:, :2] for p in made.getObjPoints())
    return dict(zip(map(int, np.asarray(made.getIds()).ravel()), quads, strict=True))


def _matrix(board: PrintedBoard, corners: Corners) -> np.ndarray | None:
    """Of a photo, from the board to pixels."""
    place = _places(board)
    known = np.array([int(k) in place for k in corners.marker_ids])
    if known.sum() < _FEWEST:
        return None
    flat = np.array([place[int(k)].mean(0) for k in corners.marker_ids[known]])
    quads = corners.marker_pixels[known]
    bound = _OFF * float(np.median(_sides(quads)))
    return cv2.findHomography(flat, quads.mean(axis=1), cv2.RANSAC, bound)[0]


def _sides(quads: np.ndarray) -> np.ndarray:
    """Sides (n, 4) of quadrangles (n, 4, 2)."""
    return np.linalg.norm(quads - np.roll(quads, 1, axis=1), axis=2)


def _mapped(homography: np.ndarray, flat: np.ndarray) -> np.ndarray:
    lifted = np.column_stack([flat, np.ones(len(flat))]) @ homography.T
    return lifted[:, :2] / lifted[:, 2:]
