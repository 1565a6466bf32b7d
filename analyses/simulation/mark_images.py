"""What a camera sees, as an image to look at: marks that were found, and where they shall be."""

from __future__ import annotations

import cv2
import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.palette import DESIRED, ESTIMATED, rgb
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE
from cdpr_drake.systems.diagrams.servo_models import ServoModel

LARGEST_WIDTH = 640
"""Images are made smaller to be no wider [px]."""

QUALITY = 80
"""Of JPEG."""

_PAPER = 246
_CORNERS_OF_TAG = 4


class MarksPicture:
    """Draws images of one camera."""

    def __init__(self, model: ServoModel) -> None:
        """For the camera and the target of a visual servo."""
        target, pinhole = model.target, model.pinhole
        self._mark = target.mark
        self._scale = min(1.0, LARGEST_WIDTH / pinhole.width)
        self._size = (round(pinhole.width * self._scale), round(pinhole.height * self._scale))
        nothing_random = np.random.default_rng(0)
        self._desired = target.project(model.X_CdO, pinhole, 0.0, nothing_random)

    def jpeg(self, marks: Array | None, image: np.ndarray | None) -> bytes:
        """An image as JPEG.

        Args:
            marks: Marks that were found, shape (size,) [px]; None: none.
            image: What the camera sees, shape (height, width, 3 or 4), red first; None: nothing is
                drawn but marks.
        """
        if image is None:
            picture = np.full((self._size[1], self._size[0], 3), _PAPER, np.uint8)
        else:
            whole = cv2.cvtColor(np.ascontiguousarray(image[:, :, :3]), cv2.COLOR_RGB2BGR)
            picture = cv2.resize(whole, self._size, interpolation=cv2.INTER_AREA)
        if marks is not None:
            self._draw(picture, marks, ESTIMATED.color, 3)
        if self._desired is not None:
            self._draw(picture, self._desired, DESIRED.color, 1)
        _, coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        return coded.tobytes()

    def _draw(self, picture: np.ndarray, marks: Array, color: str, width: int) -> None:
        blue_first = tuple(round(255.0 * value) for value in reversed(rgb(color)))
        if self._mark == "corners":
            self._draw_points(picture, marks.reshape(-1, 2), blue_first, width)
            return
        for ellipse in marks.reshape(-1, ELLIPSE_SIZE):
            if np.all(np.isfinite(ellipse)):
                self._draw_ellipse(picture, ellipse, blue_first, width)

    def _draw_points(
        self, picture: np.ndarray, points: Array, color: tuple[int, ...], width: int
    ) -> None:
        shown = self._scale * points
        if len(points) % _CORNERS_OF_TAG == 0:
            for four in shown.reshape(-1, _CORNERS_OF_TAG, 2):
                if np.all(np.isfinite(four)):
                    corners = np.round(four).astype(np.int32)
                    cv2.polylines(picture, [corners], True, color, width, cv2.LINE_AA)
        for point in shown[np.all(np.isfinite(shown), axis=1)]:
            center = (round(float(point[0])), round(float(point[1])))
            cv2.circle(picture, center, 3, color, -1, cv2.LINE_AA)

    def _draw_ellipse(
        self, picture: np.ndarray, ellipse: Array, color: tuple[int, ...], width: int
    ) -> None:
        u, v, n20, n11, n02 = ellipse
        values, vectors = np.linalg.eigh(np.array([[n20, n11], [n11, n02]]))
        axes = [2.0 * self._scale * float(np.sqrt(value)) for value in np.maximum(values, 0.0)]
        angle = float(np.degrees(np.arctan2(vectors[1, 0], vectors[0, 0])))
        center = (round(self._scale * float(u)), round(self._scale * float(v)))
        size = (round(axes[0]), round(axes[1]))
        cv2.ellipse(picture, center, size, angle, 0.0, 360.0, color, width, cv2.LINE_AA)
        cv2.circle(picture, center, 2, color, -1, cv2.LINE_AA)
