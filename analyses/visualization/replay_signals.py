"""What a replay shows beside its scene: tensions, slack cables, what the camera saw.

All of it stands in the page as numbers in base64, about a tenth of what the scene takes.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from cdpr_drake.analyses.visualization.curves import path_rows
from cdpr_drake.arrays import Array
from cdpr_drake.vision.pinhole import Pinhole

CURVE_BINS = 200
"""Pieces of a curve, each drawn by its extremes, so that no peak is lost between two frames."""

FILM_WIDTH, FILM_RATE, MOST_IMAGES = 320, 5.0, 400
"""Images taken from a film: their width [px], how many a second [Hz], how many at most."""

FILM_QUALITY = 70
"""Of these images, as JPEG, from 0 to 100."""


@dataclass(frozen=True, kw_only=True)
class CameraView:
    """What the camera of a run sees.

    Attributes:
        pinhole: The camera.
        kind: Where its marks come from, "projected" or "rendered".
        mark: What its marks are, "corners" or "ellipses"; the log has them as "corners_px", with
            "found" beside them.
        desired: From which time on [s] which marks are desired, shape (size,) [px, px^2]; None
            where the target is not wholly in view there.
        film: A file with what it saw; None where nobody recorded that.
        film_times: Times of the film's images, shape (k,) [s].
    """

    pinhole: Pinhole
    kind: str
    mark: str
    desired: Sequence[tuple[float, Array | None]] = ()
    film: Path | None = None
    film_times: Array | None = None


def frame_signals(
    log: Mapping[str, Array], shown: Sequence[int], slack: np.ndarray
) -> dict[str, Any]:
    """Times, tensions and slack cables of the frames of a replay.

    Args:
        log: "time", shape (n,) [s], and "tensions", shape (n, m) [N].
        shown: Rows of the frames.
        slack: Whether a cable is slack at a frame, shape (frames, m).
    """
    rows = list(shown)
    return {
        "time": packed(log["time"][rows], np.float64),
        "tensions": packed(log["tensions"][rows], np.float32),
        "slack": packed(slack, np.uint8),
    }


def tension_curves(
    log: Mapping[str, Array], limits: tuple[float, float] | None = None
) -> dict[str, Any]:
    """Tensions over time, with every peak, and the limits that they should keep [N]."""
    rows = path_rows(log["tensions"], CURVE_BINS)
    return {
        "time": packed(log["time"][rows], np.float64),
        "tensions": packed(log["tensions"][rows], np.float32),
        "limits": None if limits is None else [float(limit) for limit in limits],
    }


def camera_signals(
    view: CameraView, log: Mapping[str, Array], shown: Sequence[int], images: Sequence[Any] = ()
) -> dict[str, Any]:
    """Marks in the image at the frames of a replay, the desired ones, and images of a film.

    Args:
        view: What the camera sees.
        log: f"{view.mark}_px", shape (n, size) [px, px^2], and "found", shape (n, 1).
        shown: Rows of the frames.
        images: As `film_images` gives them.
    """
    rows = list(shown)
    marks = log[f"{view.mark}_px"][rows]
    return {
        "width": view.pinhole.width,
        "height": view.pinhole.height,
        "kind": view.kind,
        "mark": view.mark,
        "size": marks.shape[1],
        "marks": packed(marks, np.float32),
        "found": packed(log["found"][rows][:, 0] > 0.0, np.uint8),
        "desired": [
            [float(time), None if some is None else [float(x) for x in some]]
            for time, some in view.desired
        ],
        "images": list(images),
    }


def film_images(view: CameraView | None) -> list[tuple[float, str]]:
    """Times [s] and images of a view's film, as addresses with the data in them; few, small ones.

    Empty where there is no film, or none that OpenCV can read.
    """
    if view is None or view.film is None or view.film_times is None or not view.film.is_file():
        return []
    times = view.film_times
    duration = float(times[-1] - times[0])
    period = max(1.0 / FILM_RATE, duration / MOST_IMAGES)
    film, images, due = cv2.VideoCapture(str(view.film)), [], float(times[0])
    height = max(1, round(FILM_WIDTH * view.pinhole.height / view.pinhole.width))
    for time in times:
        if not film.grab():
            break
        if time < due - 1e-9:
            continue
        read, image = film.retrieve()
        if not read:
            break
        small = cv2.resize(image, (FILM_WIDTH, height), interpolation=cv2.INTER_AREA)
        _, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, FILM_QUALITY])
        words = base64.b64encode(jpeg.tobytes()).decode("ascii")
        images.append((float(time), f"data:image/jpeg;base64,{words}"))
        due = float(time) + period
    film.release()
    return images


def packed(values: Any, kind: type) -> str:
    """Numbers, row by row, little-endian, in base64."""
    array = np.ascontiguousarray(values, np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(array.tobytes()).decode("ascii")
