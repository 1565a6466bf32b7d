"""What a page of the browser says beside the 3D scene: time, tensions, camera, what lines mean.

Meshcat's page is one file that needs no server, and stays so: all of this is written into it, from
`replay_page.css` and `replay_page.js`. Numbers stand there in base64, row by row, little-endian,
and take about a tenth of the scene.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from cdpr_drake.analyses.frame.thinning import path_rows
from cdpr_drake.arrays import Array
from cdpr_drake.palette import (
    BOUND,
    DARK_GROUND,
    DESIRED,
    SLACK,
    TARGET,
    TENSIONS,
    UNKNOWN,
    Dash,
    Look,
    nth_look,
    on_dark,
)
from cdpr_drake.vision.pinhole import Pinhole

DASHES: dict[Dash, list[float]] = {"-": [], "--": [7, 4], "-.": [8, 3, 2, 3], ":": [2, 3]}
"""Styles of matplotlib as lengths of dashes and gaps [px]."""

CURVE_BINS = 200
"""Pieces of a curve, each drawn by its extremes, so that no peak is lost between two frames."""

FILM_WIDTH, FILM_RATE, MOST_IMAGES, FILM_QUALITY = 320, 5.0, 400, 70
"""Images of a film: width [px], rate [Hz], largest number, quality as JPEG from 0 to 100."""


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
        film: A file with what it saw; None: there is none.
        film_times: Times of the film's images, shape (k,) [s].
    """

    pinhole: Pinhole
    kind: str
    mark: str
    desired: Sequence[tuple[float, Array | None]] = ()
    film: Path | None = None
    film_times: Array | None = None


def with_notes(
    page: str, names: Sequence[str], places: Array, full_scale: float, *,
    title: str = "", lines: Sequence[tuple[str, Look]] = (), known: bool = True,
    frames: Mapping[str, Any] | None = None, curves: Mapping[str, Any] | None = None,
    camera: Mapping[str, Any] | None = None,
) -> str:  # fmt: skip
    """Meshcat's page with notes; it opens without a server as before.

    Args:
        page: The page.
        names: Of the cables.
        places: Where their names stand, in W, shape (3, m) [m].
        full_scale: Tension of the last colour [N]; 0: tensions are not coloured.
        title: What the page shows.
        lines: What is drawn in addition to the robot, with its look.
        known: True if the tension of any cable is known; else there are grey cables alone.
        frames: Of a recording, from `frame_signals`; None: nothing is recorded.
        curves: From `tension_curves`; None: nothing is recorded.
        camera: From `camera_signals`; None: there is no camera.
    """
    legend = [*lines, *([] if known else [("cables, tensions unknown", UNKNOWN)])]
    data = {
        "names": list(names),
        "places": [[float(x) for x in place] for place in places.T],
        "looks": [_look(nth_look(number)) for number in range(len(names))],
        "roles": {"desired": _look(DESIRED), "target": _look(TARGET), "bound": _look(BOUND)},
        "scale": float(full_scale) if known else 0.0,
        "colors": TENSIONS,
        "slack": SLACK if known else None,
        "title": title,
        "lines": [[words, _look(look)] for words, look in legend],
        "frames": frames,
        "curves": curves,
        "camera": camera,
        "dark_ground": DARK_GROUND,
    }
    words = json.dumps(data).replace("<", "\\u003c")  # no name can end the script
    style, program = (
        Path(__file__).with_name(f"replay_page.{ending}").read_text(encoding="utf-8")
        for ending in ("css", "js")
    )
    body = page.rindex("</body>")
    page = (
        f"{page[:body]}<style>\n{style.replace('@DARK_GROUND@', DARK_GROUND)}</style>\n"
        f'<script type="application/json" id="cdpr-data">{words}</script>\n'
        f"<script>\n{program}</script>\n{page[body:]}"
    )
    heading = escape(" ".join(title.split()) or "cdpr_drake")
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{heading}</title>", 1)
    return page.replace(
        "<head>",
        '<head>\n  <meta name="viewport" content="width=device-width, initial-scale=1">'
        '\n  <link rel="icon" href="data:,">',  # else a browser asks the server for one
        1,
    )


def _look(look: Look) -> dict[str, Any]:
    """Colours on light and on dark ground, and dashes [px]."""
    dash = DASHES[look.dash] if isinstance(look.dash, str) else list(look.dash[1])
    return {"light": look.color, "dark": on_dark(look.color), "dash": dash}


def frame_signals(
    log: Mapping[str, Array], shown: Sequence[int], slack: np.ndarray
) -> dict[str, Any]:
    """Times, tensions and slack cables of the frames of a replay.

    Args:
        log: "time", shape (n,) [s], and "tensions", shape (n, m) [N].
        shown: Rows of the frames.
        slack: True where a cable is slack at a frame, shape (frames, m).
    """
    rows = list(shown)
    return {
        "time": packed(log["time"][rows], np.float64),
        "tensions": packed(log["tensions"][rows], np.float32),
        "slack": packed(slack, np.uint8),
    }


def tension_curves(log: Mapping[str, Array], limits: tuple[float, float]) -> dict[str, Any]:
    """Tensions over time, with every peak, and the limits that they should keep [N]."""
    rows = path_rows(log["tensions"], CURVE_BINS)
    return {
        "time": packed(log["time"][rows], np.float64),
        "tensions": packed(log["tensions"][rows], np.float32),
        "limits": [float(limit) for limit in limits],
    }


def camera_signals(
    view: CameraView, log: Mapping[str, Array], shown: Sequence[int], images: Sequence[Any] = ()
) -> dict[str, Any]:
    """Marks in the image at the frames of a replay, the desired ones, and images of a film.

    Args:
        view: What the camera sees.
        log: f"{view.mark}_px", shape (n, size) [px, px^2], and "found", shape (n, 1).
        shown: Rows of the frames.
        images: From `film_images`.
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
            [float(time), None if desired is None else [float(x) for x in desired]]
            for time, desired in view.desired
        ],
        "images": list(images),
    }


def film_images(view: CameraView | None) -> list[tuple[float, str]]:
    """Times [s] and images of a view's film, as addresses with the data in them; few, small ones.

    Empty without a film, or if OpenCV cannot read it.
    """
    if view is None or view.film is None or view.film_times is None or not view.film.is_file():
        return []
    times = view.film_times
    period = max(1.0 / FILM_RATE, float(times[-1] - times[0]) / MOST_IMAGES)
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
    """Numbers as the page reads them."""
    array = np.ascontiguousarray(values, np.dtype(kind).newbyteorder("<"))
    return base64.b64encode(array.tobytes()).decode("ascii")
