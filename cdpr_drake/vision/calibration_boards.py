"""Boards that calibrate cameras: chessboards, ChArUco boards and grids of AprilTags.

`find` gives the corners of a board in one image, to fractions of a pixel, without fitting lines to
edges, which a lens bends. Corners are in the board's plane z = 0, x along its columns and y along
its rows, as OpenCV draws it.

Source: OpenCV, modules objdetect and calib3d; Garrido-Jurado et al., Pattern Recognition 47(6),
2014, for ArUco.
"""

from __future__ import annotations

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

REFINED = 5
"""Half the edge of the window in which a corner is refined, at most [px]."""


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
        if self.kind == CHARUCO:
            return cv2.aruco.CharucoDetector(self.drawing)
        # Subpixel refinement looks at the corner alone; lines along edges would be off where a lens
        # bends them.
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
        return cv2.aruco.ArucoDetector(self.drawing.getDictionary(), parameters)

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
        there, uv = cv2.findChessboardCornersSB(
            gray, inner, flags=cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_ACCURACY
        )
        if not there:
            return None
        y, x = np.mgrid[: inner[1], : inner[0]]
        points = self.size * np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        return points, uv.reshape(-1, 2)

    def _find_charuco(self, gray: np.ndarray) -> tuple[Array, Array] | None:
        uv, ids, _, _ = self._detector.detectBoard(gray)
        if ids is None or len(ids) < FEWEST_CORNERS:
            return None
        points = np.asarray(self.drawing.getChessboardCorners())[np.ravel(ids)]
        return points, uv.reshape(-1, 2)

    def _find_tags(self, gray: np.ndarray) -> tuple[Array, Array] | None:
        corners, ids, _ = self._detector.detectMarkers(gray)
        if ids is None:
            return None
        points, uv = self.drawing.matchImagePoints(corners, ids)
        if points is None or len(points) < FEWEST_CORNERS:
            return None
        uv = uv.reshape(-1, 2)
        # No wider than a cell of a small tag, which has eight along its edge.
        sides = np.linalg.norm(
            uv.reshape(-1, 4, 2) - np.roll(uv.reshape(-1, 4, 2), 1, axis=1), axis=2
        )
        half = int(np.clip(np.min(sides) / 16.0, 2, REFINED))
        criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-3)
        refined = cv2.cornerSubPix(
            gray, np.ascontiguousarray(uv, np.float32), (half, half), (-1, -1), criteria
        )
        return points.reshape(-1, 3), refined.reshape(-1, 2)
