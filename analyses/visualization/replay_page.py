"""What a page of the browser says beside the 3D scene: time, tensions, camera, what lines mean.

Meshcat's page is one file that needs no server, and stays so: all of this is written into it, from
`replay_page.css` and `replay_page.js`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

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

DASHES: dict[Dash, list[float]] = {"-": [], "--": [7, 4], "-.": [8, 3, 2, 3], ":": [2, 3]}
"""Styles of matplotlib as lengths of dashes and gaps [px]."""

NAME = "replay_page"
"""Of the files with the style and the program of the page."""


@dataclass(frozen=True)
class PageNotes:
    """What there is to say.

    Attributes:
        names: Of the cables.
        places: Where their names stand, in W, shape (3, m) [m].
        full_scale: Tension of the last colour [N]; 0: tensions are not coloured.
        known: Whether the tension of any cable is known; else there are grey cables alone.
        title: What the page shows.
        lines: What is drawn beside the robot, with its look.
        frames: Of a recording, as `frame_signals` gives them; None where nothing is recorded.
        curves: As `tension_curves` gives them; None where nothing is recorded.
        camera: As `camera_signals` gives them; None where there is no camera.
    """

    names: Sequence[str]
    places: Array
    full_scale: float
    known: bool = True
    title: str = ""
    lines: Sequence[tuple[str, Look]] = ()
    frames: dict[str, Any] | None = None
    curves: dict[str, Any] | None = None
    camera: dict[str, Any] | None = None


def with_notes(page: str, notes: PageNotes) -> str:
    """Meshcat's page with notes; it opens without a server as before."""
    lines = [*notes.lines, *([] if notes.known else [("cables, tensions unknown", UNKNOWN)])]
    data = {
        "names": list(notes.names),
        "places": [[float(x) for x in place] for place in notes.places.T],
        "looks": [_look(nth_look(number)) for number in range(len(notes.names))],
        "roles": {"desired": _look(DESIRED), "target": _look(TARGET), "bound": _look(BOUND)},
        "scale": float(notes.full_scale) if notes.known else 0.0,
        "colors": TENSIONS,
        "slack": SLACK if notes.known else None,
        "title": notes.title,
        "lines": [[words, _look(look)] for words, look in lines],
        "frames": notes.frames,
        "curves": notes.curves,
        "camera": notes.camera,
        "dark_ground": DARK_GROUND,
    }
    words = json.dumps(data).replace("<", "\\u003c")  # no name can end the script
    body = page.rindex("</body>")
    added = (
        f"<style>\n{_part('css').replace('@DARK_GROUND@', DARK_GROUND)}</style>\n"
        f'<script type="application/json" id="cdpr-data">{words}</script>\n'
        f"<script>\n{_part('js')}</script>\n"
    )
    page = f"{page[:body]}{added}{page[body:]}"
    title = escape(" ".join(notes.title.split()) or "cdpr_drake")
    page = page.replace("<title>Drake MeshCat</title>", f"<title>{title}</title>", 1)
    return page.replace(
        "<head>",
        '<head>\n  <meta name="viewport" content="width=device-width, initial-scale=1">'
        '\n  <link rel="icon" href="data:,">',  # else a browser asks the server for one
        1,
    )


def _part(ending: str) -> str:
    return (Path(__file__).parent / f"{NAME}.{ending}").read_text(encoding="utf-8")


def _look(look: Look) -> dict[str, Any]:
    """Colours on light and on dark ground, and dashes [px]."""
    dash = DASHES[look.dash] if isinstance(look.dash, str) else list(look.dash[1])
    return {"light": look.color, "dark": on_dark(look.color), "dash": dash}
