"""Boards that calibrate cameras: chessboards, ChArUco boards and grids of AprilTags.

`find` gives the corners of a board in one image, to fractions of a pixel, without fitting lines to
edges, which a lens bends. Corners are in the board's plane z = 0, x along its columns and y along
its rows, as OpenCV draws it.

Source: OpenCV, modules objdetect and calib3d; Garrido-Jurado et al., Pattern Recognition 47(6),
2014, for ArUco.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CameraCalibrationError, accepted_names

CHESSBOARD, CHARUCO, TAGS = "chessboard", "charuco", "tags"
BOARDS = (CHARUCO, TAGS, CHESSBOARD)

MARKER_SHARE = 0.75
"""Edge of a ChArUco board's markers per edge of a square, where nothing is said."""

GAP_SHARE = 0.3
"""Gap between tags per edge of a tag, where nothing is said."""

DICTIONARIES = {CHARUCO: "4X4_250", TAGS: "APRILTAG_36h11"}
"""Markers of boards, where nothing is said, as OpenCV names them."""

FEWEST_CORNERS = 8
"""Of a board that counts as found: a pose and a homography have eight numbers from four."""

LEAST_WINDOW, MOST_WINDOW = 2, 11
"""Half the edge of the window in which a corner is refined [px]."""

WINDOW_SHARES: dict[str, tuple[float, ...]] = {
    CHESSBOARD: (0.3,),
    CHARUCO: (0.3,),
    TAGS: (1.0 / 16.0,),
}
"""The same per distance of neighbouring corners, one refinement after the other. What is around a
corner of a chessboard is the same when turned by half a turn, and so are the errors that blur
makes, which cancel. Corners of a ChArUco board are first found among the dark rims of its markers,
then in the white between corner and markers. The window keeps to half a cell of a tag, which has
eight."""

SHARPEST, BLURRED = 3, (5, 53, 12)
"""How much darker than its surroundings a marker is, of 255, and the least, largest and step of
the edges of these surroundings [px]: dim, flat and blurred pictures lose markers with OpenCV's 7
and 3 to 23."""

FINDERS: tuple[tuple[Callable[..., tuple[bool, np.ndarray]], int], ...] = (
    (cv2.findChessboardCorners, cv2.CALIB_CB_ADAPTIVE_THRESH),
    (cv2.findChessboardCornersSB, cv2.CALIB_CB_ACCURACY),
    (cv2.findChessboardCornersSB, cv2.CALIB_CB_EXHAUSTIVE),
    (cv2.findChessboardCornersSB, cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_EXHAUSTIVE),
)
"""OpenCV's finders of chessboards, one after the other until one finds it. The last one makes the
histogram even (`CALIB_CB_NORMALIZE_IMAGE`), which melts board and wall together in many images."""


@dataclass(frozen=True)
class CalibrationBoard:
    """A board as it was printed.

    Attributes:
        kind: One of `BOARDS`.
        columns: Squares along x; of tags the tags.
        rows: Squares along y.
        size: Edge of a square, of tags of a tag's black square [m].
        inner: Edge of a ChArUco board's markers, gap between tags [m]; None: their usual share.
        markers: Name of the dictionary of markers; None: the usual one.
    """

    kind: str
    columns: int
    rows: int
    size: float
    inner: float | None = None
    markers: str | None = None

    def __post_init__(self) -> None:
        """Refuses what is no board.

        Raises:
            CameraCalibrationError: Names what.
        """
        if self.kind not in BOARDS:
            raise CameraCalibrationError(
                f"board: found {self.kind!r}; {accepted_names(self.kind, BOARDS)}"
            )
        least = 1 if self.kind == TAGS else 3
        if not (least <= self.columns <= 100 and least <= self.rows <= 100):
            raise CameraCalibrationError(
                f"squares: found {self.columns}x{self.rows}; accepted: {least} to 100 along "
                "each side"
            )
        if not 0.0 < self.size < 10.0:
            raise CameraCalibrationError(
                f"size: found {self.size:g} [m]; accepted: above 0 and below 10"
            )
        if self.kind == CHESSBOARD and (self.inner is not None or self.markers is not None):
            raise CameraCalibrationError(
                "board: found markers on a chessboard; accepted: none, or the board charuco"
            )
        if self.inner is not None and not 0.0 < self.inner < 10.0 * self.size:
            raise CameraCalibrationError(
                f"marker, gap: found {self.inner:g} [m]; accepted: above 0 and below ten squares"
            )
        if self.kind == CHARUCO and self.inner is not None and self.inner >= self.size:
            raise CameraCalibrationError(
                f"marker: found {self.inner:g} [m]; accepted: less than the square's {self.size:g}"
            )
        if self.kind != CHESSBOARD:
            found = self.markers or DICTIONARIES[self.kind]
            if not hasattr(cv2.aruco, f"DICT_{found}"):
                known = [name[5:] for name in dir(cv2.aruco) if name.startswith("DICT_")]
                raise CameraCalibrationError(
                    f"markers: found {found!r}; {accepted_names(found, sorted(known))}"
                )

    @property
    def together(self) -> int:
        """Corners that follow each other in what `find` gives and are of one tag; else 1."""
        return 4 if self.kind == TAGS else 1

    @cached_property
    def drawing(self) -> cv2.aruco.Board:
        """The board of OpenCV, which can draw it; not of chessboards."""
        family = cv2.aruco.getPredefinedDictionary(
            getattr(cv2.aruco, f"DICT_{self.markers or DICTIONARIES[self.kind]}")
        )
        size = (self.columns, self.rows)
        if self.kind == CHARUCO:
            inner = MARKER_SHARE * self.size if self.inner is None else self.inner
            return cv2.aruco.CharucoBoard(size, self.size, inner, family)
        inner = GAP_SHARE * self.size if self.inner is None else self.inner
        return cv2.aruco.GridBoard(size, self.size, inner, family)

    @cached_property
    def _detector(self) -> cv2.aruco.CharucoDetector | cv2.aruco.ArucoDetector:
        parameters = cv2.aruco.DetectorParameters()
        # Subpixel refinement looks at the corner alone; lines along edges would be off where a lens
        # bends them.
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        parameters.adaptiveThreshConstant = SHARPEST
        least, most, step = BLURRED
        parameters.adaptiveThreshWinSizeMin = least
        parameters.adaptiveThreshWinSizeMax = most
        parameters.adaptiveThreshWinSizeStep = step
        if self.kind == TAGS:
            return cv2.aruco.ArucoDetector(self.drawing.getDictionary(), parameters)
        charuco = cv2.aruco.CharucoParameters()
        charuco.minMarkers, charuco.tryRefineMarkers = 1, True
        return cv2.aruco.CharucoDetector(self.drawing, charuco, parameters)

    def find(self, gray: np.ndarray) -> tuple[Array, Array] | None:
        """Corners of the board in an image, or None where too few are seen.

        Args:
            gray: Shape (height, width), 8 bits.

        Returns:
            Corners on the board, shape (n, 3) [m], and in the image, shape (n, 2) [px].
        """
        found = getattr(self, f"_find_{self.kind}")(gray)
        if found is None or len(found[0]) < FEWEST_CORNERS:
            return None
        points, uv = found
        flat = points[:, :2] - np.mean(points[:, :2], axis=0)
        if np.linalg.matrix_rank(flat, tol=0.1 * self.size) < 2:  # corners of one row
            return None
        return np.asarray(points, float), np.asarray(uv, float)

    def _find_chessboard(self, gray: np.ndarray) -> tuple[Array, Array] | None:
        inner = (self.columns - 1, self.rows - 1)
        y, x = np.mgrid[: inner[1], : inner[0]]
        points = self.size * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        for finder, flags in FINDERS:
            there, uv = finder(gray, inner, flags=flags)
            if there:
                return points, self._refined(gray, points, uv.reshape(-1, 2))
        return None

    def _find_charuco(self, gray: np.ndarray) -> tuple[Array, Array] | None:
        uv, ids, _, _ = self._detector.detectBoard(gray)
        if ids is None or len(ids) < FEWEST_CORNERS:
            return None
        points = np.asarray(self.drawing.getChessboardCorners())[np.ravel(ids)]
        return points, self._refined(gray, points, uv.reshape(-1, 2))

    def _find_tags(self, gray: np.ndarray) -> tuple[Array, Array] | None:
        corners, ids, _ = self._detector.detectMarkers(gray)
        if ids is None:
            return None
        points, uv = self.drawing.matchImagePoints(corners, ids)
        if points is None or len(points) < FEWEST_CORNERS:
            return None
        points = points.reshape(-1, 3)
        return points, self._refined(gray, points, uv.reshape(-1, 2))

    def _refined(self, gray: np.ndarray, points: Array, uv: Array) -> Array:
        """Corners where gradients around them say, in windows as wide as the board lets them be.

        Args:
            gray: As for `find`.
            points: Corners on the board, shape (n, 3) [m].
            uv: The same about where they are in the image, shape (n, 2) [px].

        Source: OpenCV, cornerSubPix; Foerstner, Guelch, A fast operator for detection and precise
        location of distinct points, corners and centres of circular features, 1987.
        """
        apart = np.linalg.norm(points[:, np.newaxis] - points, axis=2)
        near = (apart > 0.0) & (apart < 1.01 * self.size)
        if not near.any():
            return uv
        least = float(np.min(np.linalg.norm(uv[:, np.newaxis] - uv, axis=2)[near]))
        criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-3)
        found = np.array(uv, np.float32, order="C")
        shares = WINDOW_SHARES[self.kind]
        if self.kind == CHARUCO:
            shares += (0.5 * (1.0 - self.drawing.getMarkerLength() / self.size),)
        for share in shares:
            half = int(np.clip(share * least, LEAST_WINDOW, MOST_WINDOW))
            found = np.asarray(cv2.cornerSubPix(gray, found, (half, half), (-1, -1), criteria))
        return np.asarray(found, float)
