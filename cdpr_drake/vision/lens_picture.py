"""Pictures through a lens: a pinhole's picture that covers the field, and where its pixels go.

A renderer draws what a pinhole sees. Of a lens it draws the pinhole's picture that has all that the
lens shows, wider for a barrel, and every pixel of the image is looked up in it, between four
pixels. The wide picture has the lens's own scale on the axis; where the lens shows more in a pixel
than the pinhole, some of what was drawn is lost, and where it shows less, the image is softer than
one drawn so large: `LensMap.scale` says by how much, over the image.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import cv2
import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import LensDistortionError
from cdpr_drake.vision.image_window import ImageWindow, whole_image, window_round
from cdpr_drake.vision.lens_distortion import FARTHEST
from cdpr_drake.vision.pinhole import Pinhole

MOST_PIXELS = 6.0
"""Of the wide picture, per pixel of the image; a wider field is drawn at a smaller scale."""

LEAST_SCALE = 0.25
"""Of the wide picture, per scale of the lens on its axis; what needs less is no field to draw as
one picture of a pinhole."""

MARGIN = 2.0
"""Pixels round what is looked up, for the pixels between which it lies."""


@dataclass(frozen=True, eq=False)
class LensMap:
    """Where the pixels of an image through a lens are in a pinhole's picture.

    Attributes:
        wide: The pinhole whose picture covers the field.
        u: Columns in that picture, shape (height, width), 32 bits [px].
        v: Rows.
        scale: Pixels of the wide picture along a pixel of the image: least and largest, by the root
            of the area. Below 1 the image is softer than one that is drawn as it is, by that share.
    """

    wide: Pinhole
    u: np.ndarray
    v: np.ndarray
    scale: tuple[float, float]

    def picture(self, drawn: np.ndarray) -> np.ndarray:
        """The image through the lens, shape (height, width, ...), of the wide picture."""
        return np.asarray(
            cv2.remap(drawn, self.u, self.v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        )


@lru_cache(maxsize=8)
def lens_map(camera: Pinhole) -> LensMap:
    """The maps of a camera with a lens, computed once.

    Raises:
        LensDistortionError: The lens has no valid field in all of the image, or so wide a one that
            no pinhole's picture has it.
    """
    if camera.distortion is None:
        raise LensDistortionError("lens_map: found a camera without distortion; accepted: one with")
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    at = np.vstack([u.ravel(), v.ravel()])
    seen = camera.distortion.undistort(
        np.vstack([(at[0] - camera.cx) / camera.fx, (at[1] - camera.cy) / camera.fy])
    )
    if not np.all(np.isfinite(seen)):
        share = 100.0 * float(np.mean(~np.isfinite(seen[0])))
        raise LensDistortionError(
            f"lens: found {share:.1f} % of the image beyond what it is valid for; accepted: one "
            "that holds up to the corners"
        )
    low = np.minimum(np.min(seen, axis=1), 0.0)
    high = np.maximum(np.max(seen, axis=1), 0.0)
    size = (high - low) * [camera.fx, camera.fy] + 2.0 * MARGIN + 1.0
    share = min(1.0, float(np.sqrt(MOST_PIXELS * camera.width * camera.height / np.prod(size))))
    if share < LEAST_SCALE:
        angle = 2.0 * np.degrees(np.arctan(np.max(np.abs(seen))))
        raise LensDistortionError(
            f"lens: found a field of {angle:.0f} deg, which a rendered camera would have to draw "
            f"at {share:.2f} of its scale; accepted: at least {LEAST_SCALE:g}, or a projected one"
        )
    fx, fy = share * camera.fx, share * camera.fy
    wide = Pinhole(
        int(np.ceil((high[0] - low[0]) * fx + 2.0 * MARGIN + 1.0)),
        int(np.ceil((high[1] - low[1]) * fy + 2.0 * MARGIN + 1.0)),
        fx, fy, float(MARGIN - low[0] * fx), float(MARGIN - low[1] * fy),
    )  # fmt: skip
    shape = (camera.height, camera.width)
    map_u = (wide.cx + fx * seen[0]).reshape(shape)
    map_v = (wide.cy + fy * seen[1]).reshape(shape)
    return LensMap(wide, map_u.astype(np.float32), map_v.astype(np.float32), _scale(map_u, map_v))


def _scale(u: Array, v: Array) -> tuple[float, float]:
    """Least and largest length in the wide picture of a pixel of the image [-]."""
    u_v, u_u = np.gradient(u)
    v_v, v_u = np.gradient(v)
    root = np.sqrt(np.abs(u_u * v_v - u_v * v_u))
    return float(np.min(root)), float(np.max(root))


def lens_picture(drawn: np.ndarray, camera: Pinhole) -> np.ndarray:
    """The image of a camera with a lens, of the picture of `lens_map(camera).wide`."""
    return lens_map(camera).picture(drawn)


def without_lens(camera: Pinhole) -> Pinhole:
    """The pinhole to draw an image by: `lens_map(camera).wide`, or the camera without one."""
    if camera.distortion is None:
        return replace(camera, believed=None)
    return lens_map(camera).wide


def _cut(u: np.ndarray, v: np.ndarray, window: ImageWindow) -> tuple[np.ndarray, np.ndarray]:
    """A window of maps."""
    rows = slice(window.v, window.v + window.height)
    columns = slice(window.u, window.u + window.width)
    return u[rows, columns], v[rows, columns]


def _window_with(u: np.ndarray, v: np.ndarray, within: ImageWindow) -> ImageWindow:
    """The window of a picture that maps look up, those beyond its rim there."""
    u, v = (
        np.clip(value, 0.0, size - 1.0) for value, size in ((u, within.width), (v, within.height))
    )
    box = np.array([np.min(u), np.min(v), np.max(u), np.max(v)], float)
    found = window_round(box, MARGIN, within)
    assert found is not None
    return found


def _looked_up(
    picture: np.ndarray, u: np.ndarray, v: np.ndarray, window: ImageWindow
) -> np.ndarray:
    """What maps look up, of a window of the picture that they are for."""
    shifted = u - np.float32(window.u), v - np.float32(window.v)
    return np.asarray(
        cv2.remap(picture, *shifted, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    )


class StraightPicture:
    """Pictures of a camera with a lens as the pinhole of `lens_map` would have taken them.

    What looks for targets takes edges for straight, rings for ellipses, and squares for images of
    squares by a homography. Through a lens they are not: on a tag of 260 pixels, lines that were
    fitted to bent edges met 2 to 3 pixels off its corners, and reading those corners does not bring
    them back. So it is pictures that are read, before anything is looked for.
    """

    def __init__(self, camera: Pinhole) -> None:
        """For a camera with a lens.

        Raises:
            LensDistortionError: As `lens_map`.
        """
        assert camera.distortion is not None
        self._camera, self.wide = camera, lens_map(camera).wide
        v, u = np.mgrid[: self.wide.height, : self.wide.width].astype(float)
        x, y = (u - self.wide.cx) / self.wide.fx, (v - self.wide.cy) / self.wide.fy
        seen = camera.distortion.distort(np.vstack([x.ravel(), y.ravel()]))
        nowhere = ~np.isfinite(seen[0])
        seen[:, nowhere] = -FARTHEST
        shape = (self.wide.height, self.wide.width)
        self._u = (camera.cx + camera.fx * seen[0]).reshape(shape).astype(np.float32)
        self._v = (camera.cy + camera.fy * seen[1]).reshape(shape).astype(np.float32)

    def picture(self, image: np.ndarray) -> np.ndarray:
        """An image of the camera without its lens, shape (height, width, ...) of `wide`."""
        return np.asarray(
            cv2.remap(image, self._u, self._v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        )

    def window(self, wanted: ImageWindow, draw: Callable[[ImageWindow], np.ndarray]) -> np.ndarray:
        """A window of the straight picture of an image through the lens, drawn no larger than that.

        It goes through the lens and back as the whole picture does: what the lens softens is soft.

        Args:
            wanted: The window of the straight picture.
            draw: Draws a window of the pinhole's picture `wide`, shape (height, width, ...).
        """
        lens = lens_map(self._camera)
        back = _cut(self._u, self._v, wanted)
        image = _window_with(*back, whole_image(self._camera))
        through = _cut(lens.u, lens.v, image)
        drawn = _window_with(*through, whole_image(self.wide))
        seen = _looked_up(draw(drawn), *through, drawn)
        return _looked_up(seen, *back, image)

    def to_ideal(self, uv: Array) -> Array:
        """Pixels of the straight picture in those of the camera without its lens, shape (2, n)."""
        w, c = self.wide, self._camera
        return np.vstack([
            c.cx + c.fx / w.fx * (uv[0] - w.cx), c.cy + c.fy / w.fy * (uv[1] - w.cy)
        ])  # fmt: skip

    def from_ideal(self, uv: Array) -> Array:
        """The inverse of `to_ideal`."""
        w, c = self.wide, self._camera
        return np.vstack([
            w.cx + w.fx / c.fx * (uv[0] - c.cx), w.cy + w.fy / c.fy * (uv[1] - c.cy)
        ])  # fmt: skip
