"""The lens from pictures of a ChArUco board: a chessboard with a marker in every white square.

The markers say which corners of the chessboard are seen, so the board may reach beyond the
picture; the corners themselves are what is measured. OpenCV finds and solves; here is what goes in
and whether to believe what comes out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.observation import Image
from polepilot.core.vehicle import Camera
from polepilot.core.verdict import Verdict
from polepilot.core.vision.lens import Lens

Array = NDArray[np.float64]

DICTIONARIES = tuple(
    sorted({name.removeprefix("DICT_").upper() for name in dir(cv2.aruco) if "DICT_" in name})
)
FEWEST_VIEWS = 3
"""Fewer pictures of the board do not determine a lens."""

_FEWEST_CORNERS = 8
_ENOUGH_VIEWS = 8
_TILTED = math.radians(15)
_FEWEST_TILTED, _ENOUGH_TILTED = 2, 3
_CELLS = (4, 3)
"""Columns and rows of the raster on which the corners should fall."""
_FEWEST_CELLS, _ENOUGH_CELLS = 0.4, 0.8
_GOOD_RMS, _FAIR_RMS = 0.4, 1.0
"""Pixels, per corner."""
_GOOD_DOUBT, _FAIR_DOUBT = 0.003, 0.01
"""Standard error of the constant, as a share of it."""
_DEPENDENCE = 2.0
"""Errors of neighbouring corners are alike: the constant is so much less certain than if each
corner had an error of its own."""
_OUTLIER = 3.0
"""A picture whose corners are off by so many times the median is left out."""


@dataclass(frozen=True, slots=True)
class Board:
    """A ChArUco board; lengths in metres. The square at the top left is black."""

    columns: int = 9
    """Squares from left to right."""
    rows: int = 6
    square: float = 0.030
    """Side of a square."""
    marker: float = 0.022
    """Side of a marker."""
    dictionary: str = "4X4_50"

    def __post_init__(self) -> None:
        if not (3 <= self.columns <= 100 and 3 <= self.rows <= 100):
            raise InputError(
                f"the board has {self.columns} x {self.rows} squares: expected 3 to 100 each way."
            )
        if not 0.001 <= self.square <= 10:
            raise InputError(f"square is {self.square} m: expected 0.001 to 10 m.")
        if not 0.2 * self.square <= self.marker <= 0.95 * self.square:
            raise InputError(
                f"marker is {self.marker} m: expected 0.2 to 0.95 of the square's {self.square} m."
            )
        if self.dictionary.upper() not in DICTIONARIES:
            raise InputError(
                f"dictionary is {self.dictionary!r}: expected one of {', '.join(DICTIONARIES)}."
            )
        markers, most = self.columns * self.rows // 2, len(self._dictionary.bytesList)
        if markers > most:
            raise InputError(
                f"the board needs {markers} markers: {self.dictionary} has {most}; take fewer "
                "squares or a larger dictionary."
            )

    @property
    def width(self) -> float:
        """From the left edge of the squares to the right one, metres."""
        return self.columns * self.square

    @property
    def height(self) -> float:
        """From the top edge of the squares to the bottom one, metres."""
        return self.rows * self.square

    @property
    def corners(self) -> int:
        """How many inner corners there are to be found."""
        return (self.columns - 1) * (self.rows - 1)

    @property
    def _dictionary(self) -> Any:
        by_name = {n.removeprefix("DICT_").upper(): n for n in dir(cv2.aruco) if "DICT_" in n}
        number = getattr(cv2.aruco, by_name[self.dictionary.upper()])
        return cv2.aruco.getPredefinedDictionary(number)

    @property
    def charuco(self) -> Any:
        """OpenCV's own board."""
        size = (self.columns, self.rows)
        return cv2.aruco.CharucoBoard(size, self.square, self.marker, self._dictionary)

    def draw(self, pixels_per_square: int) -> Image:
        """The board alone, black on white: rows x columns, grey levels."""
        size = (self.columns * pixels_per_square, self.rows * pixels_per_square)
        return np.asarray(self.charuco.generateImage(size), np.uint8)

    def black(self) -> Iterator[tuple[float, float, float, float]]:
        """The black parts as rectangles: left, top, width, height from the top left corner, m."""
        side = self.square
        for row in range(self.rows):
            for column in range(row % 2, self.columns, 2):
                yield column * side, row * side, side, side
        dictionary = self._dictionary
        modules = int(dictionary.markerSize) + 2
        for number, outline in zip(self.charuco.getIds(), self.charuco.getObjPoints(), strict=True):
            left, top = float(outline[0][0]), float(outline[0][1])
            bits = cv2.aruco.generateImageMarker(dictionary, int(number), modules, borderBits=1)
            unit = self.marker / modules
            for y, line in enumerate(bits < 128):
                edges = np.flatnonzero(np.diff(line.astype(np.int8), prepend=0, append=0))
                for first, last in edges.reshape(-1, 2):
                    yield left + first * unit, top + y * unit, (last - first) * unit, unit


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """The corners of the board that one picture shows."""

    name: str
    """Of the picture, for messages."""
    width: int
    height: int
    pixels: Array
    """corners x 2: column and row; centres of pixels are integers."""
    places: Array
    """corners x 3: on the board, metres."""


@dataclass(frozen=True, slots=True)
class ViewResult:
    """How one picture fits: rms of its corners in pixels, and how much its board is tilted."""

    view: BoardView
    rms: float
    tilt: float
    """Between the optical axis and the board's normal, radians."""
    used: bool = True


@dataclass(frozen=True, slots=True)
class LensFit:
    """The camera that explains the pictures, and how well it does."""

    camera: Camera
    constant_error: float
    """Standard error of the constant, pixels."""
    rms: float
    """Of all corners that were used, pixels."""
    views: tuple[ViewResult, ...]


def find_board(image: Image, board: Board, name: str = "the picture") -> BoardView | None:
    """The board's corners in a picture (BGR or grey); None where too few are to be seen."""
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    charuco = board.charuco
    found: Any = cv2.aruco.CharucoDetector(charuco).detectBoard(grey)
    corners, ids = found[:2]
    if ids is None or len(ids) < _FEWEST_CORNERS:
        return None
    if charuco.checkCharucoCornersCollinear(ids):
        return None
    places, pixels = charuco.matchImagePoints(corners, ids)
    return BoardView(
        name=name,
        width=grey.shape[1],
        height=grey.shape[0],
        pixels=np.asarray(pixels, np.float64).reshape(-1, 2),
        places=np.asarray(places, np.float64).reshape(-1, 3),
    )


def fit_lens(views: Sequence[BoardView]) -> LensFit:
    """Constant (one for both directions), centre and distortion from several views of a board.

    Raises:
        InputError: too few views, or views that determine no camera.
    """
    if len(views) < FEWEST_VIEWS:
        raise InputError(
            f"{len(views)} of the pictures show enough of the board: expected at least "
            f"{FEWEST_VIEWS}; ten or more is better."
        )
    whole = _Solution(views)
    limit = _OUTLIER * float(np.median(whole.errors))
    kept = [view for view, rms in zip(views, whole.errors, strict=True) if rms <= limit]
    solution = whole if len(kept) in (len(views), *range(FEWEST_VIEWS)) else _Solution(kept)
    used = {id(view) for view in solution.views}
    tilts = {id(v): tilt for v, tilt in zip(solution.views, solution.tilts, strict=True)}
    errors = {id(v): float(e) for v, e in zip(solution.views, solution.errors, strict=True)}
    return LensFit(
        camera=solution.camera,
        constant_error=solution.constant_error,
        rms=solution.rms,
        views=tuple(
            ViewResult(
                view, errors.get(id(view), float(rms)), tilts.get(id(view), tilt), id(view) in used
            )
            for view, rms, tilt in zip(views, whole.errors, whole.tilts, strict=True)
        ),
    )


class _Solution:
    """OpenCV's answer for some views."""

    def __init__(self, views: Sequence[BoardView]) -> None:
        self.views = tuple(views)
        self._answer = self._solve(cv2.CALIB_FIX_K3)
        # A third radial coefficient only where the pictures really ask for it.
        richer = self._solve(0)
        k3, doubt = richer[2].ravel()[4], richer[5].ravel()[8]
        if abs(k3) > 4 * doubt and richer[0] < 0.98 * self._answer[0]:
            self._answer = richer

    def _solve(self, flags: int) -> Any:
        size = (self.views[0].width, self.views[0].height)
        try:
            return cv2.calibrateCameraExtended(
                [view.places.astype(np.float32) for view in self.views],
                [view.pixels.astype(np.float32) for view in self.views],
                size,
                np.eye(3),
                np.zeros(5),
                flags=flags | cv2.CALIB_FIX_ASPECT_RATIO,
            )
        except cv2.error as error:
            raise InputError(
                "these views of the board determine no camera: hold it at several distances, "
                "tilted to several sides."
            ) from error

    @property
    def camera(self) -> Camera:
        view, matrix = self.views[0], self._answer[1]
        return Camera(
            constant=float(matrix[0, 0]),
            width=view.width,
            height=view.height,
            center_x=float(matrix[0, 2]),
            center_y=float(matrix[1, 2]),
            distortion=tuple(float(value) for value in self._answer[2].ravel()[:5]),
        )

    @property
    def rms(self) -> float:
        return float(self._answer[0])

    @property
    def constant_error(self) -> float:
        return _DEPENDENCE * float(self._answer[5].ravel()[:2].max())

    @property
    def errors(self) -> Array:
        return np.asarray(self._answer[7], np.float64).ravel()

    @property
    def tilts(self) -> list[float]:
        normals = [cv2.Rodrigues(np.asarray(turn, np.float64))[0][:, 2] for turn in self._answer[3]]
        return [math.acos(min(abs(float(normal[2])), 1.0)) for normal in normals]


def judge(fit: LensFit) -> Verdict:
    """What to think of a fit, in words."""
    used = [result for result in fit.views if result.used]
    cells = _cells(fit.camera, [result.view for result in used])
    tilted = sum(result.tilt > _TILTED for result in used)
    notes = tuple(_notes(fit, cells, tilted))
    doubt = fit.constant_error / fit.camera.constant
    corners = f"the corners fit within {fit.rms:.2f} pixels (rms)"
    if tilted < _FEWEST_TILTED:
        # The solver's own standard error knows nothing of this.
        return Verdict("poor", "no tilt: the constant cannot be told from the distance.", notes)
    if cells.mean() < _FEWEST_CELLS:
        return Verdict("poor", "the board was seen in a small part of the picture only.", notes)
    if not math.isfinite(doubt) or not Lens.of(fit.camera).covers(fit.camera):
        return Verdict("poor", "no real lens bends like this; the views say too little.", notes)
    if fit.rms > _FAIR_RMS:
        return Verdict("poor", f"{corners}: is the board flat, and the pictures sharp?", notes)
    if doubt > _FAIR_DOUBT:
        return Verdict("poor", f"the constant is known to {doubt * 100:.1f} % only.", notes)
    if fit.rms <= _GOOD_RMS and doubt <= _GOOD_DOUBT and not notes:
        return Verdict("good", f"{corners}.", notes)
    return Verdict("fair", f"{corners}; the constant is known to {doubt * 100:.2f} %.", notes)


def _notes(fit: LensFit, cells: NDArray[np.bool_], tilted: int) -> Iterator[str]:
    used = sum(result.used for result in fit.views)
    for result in fit.views:
        if not result.used:
            yield f"{result.view.name} was left out: its corners are {result.rms:.1f} pixels off."
    if used < _ENOUGH_VIEWS:
        yield f"Only {used} pictures: ten or more make it surer."
    if tilted < _ENOUGH_TILTED:
        yield "Hardly any tilt: turn the board by 20 to 40 degrees, to several sides."
    if cells.mean() < _ENOUGH_CELLS:
        names = ("at the left", "at the right", "at the top", "at the bottom")
        sides = (cells[:, 0], cells[:, -1], cells[0], cells[-1])
        bare = [name for name, side in zip(names, sides, strict=True) if side.mean() <= 0.5]
        where = ", ".join(bare) or "in some parts of the picture"
        yield f"Too few corners {where}: hold the board there too, or the lens is a guess there."


def _cells(camera: Camera, views: Sequence[BoardView]) -> NDArray[np.bool_]:
    """In which cells of a coarse raster corners were seen: rows x columns."""
    pixels = np.concatenate([view.pixels for view in views])
    columns, rows = _CELLS
    cells = np.zeros((rows, columns), np.bool_)
    across = np.clip(pixels[:, 0] / camera.width * columns, 0, columns - 1).astype(np.intp)
    down = np.clip(pixels[:, 1] / camera.height * rows, 0, rows - 1).astype(np.intp)
    cells[down, across] = True
    return cells
