"""Figures as files: which formats there are, and that the same figure gives the same bytes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.deferred_figures import write_pictures
from cdpr_drake.analyses.reporting.written_files import whole_file
from cdpr_drake.analyses.visualization.figure_style import DPI, NO_LAYOUT, STYLE, lay_out

DEFAULT_FORMATS = ("png",)

UNDATED: dict[str, dict[str, Any]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
"""Metadata that keep the day out of a file, by its ending."""

FILES: Any = {
    "pdf.fonttype": 42,  # TrueType, embedded: text can be searched and edited, publishers ask it
    "ps.fonttype": 42,
    "svg.fonttype": "path",  # looks the same where the font is missing
    "svg.hashsalt": "cdpr_drake",  # else ids are drawn at random
}


def save_figure(figure: Figure, path: Path) -> Path:
    """Writes a figure, as the ending of its file says, PNG without one, and returns its path.

    The file appears whole or not at all; an older one stays until then.

    Raises:
        OSError: It cannot be written, for instance on a full disk.
    """
    path = path if path.suffix else path.with_name(f"{path.name}.{DEFAULT_FORMATS[0]}")
    with whole_file(path) as part:
        _put(figure, part)
    return path


def _put(figure: Figure, path: Path) -> None:
    """Writes a figure in place."""
    with mpl.rc_context({**STYLE, **FILES, **NO_LAYOUT}):
        figure.savefig(path, dpi=DPI, metadata=UNDATED.get(path.suffix[1:].lower()))


def figure_png(figure: Figure) -> bytes:
    """A figure as the content of a PNG file."""
    buffer = BytesIO()
    lay_out(figure)
    with mpl.rc_context({**STYLE, **NO_LAYOUT}):
        figure.savefig(buffer, format="png", dpi=DPI)
    return buffer.getvalue()


def figure_writers(
    drawn: Mapping[str, Callable[[], Figure]], formats: Sequence[str] = DEFAULT_FORMATS
) -> dict[str, Callable[[Path], Path]]:
    """What writes figures, by the names of their files, from what draws them by name.

    A figure is drawn when its first file is written and dropped after its last.
    """
    writers: dict[str, Callable[[Path], Path]] = {}
    for name, draw in drawn.items():
        once = _DrawnOnce(draw, len(formats))
        for ending in formats:
            writers[f"{name}.{ending}"] = once.write
    return writers


def write_figures(
    folder: Path,
    drawn: Mapping[str, Callable[[], Figure]],
    formats: Sequence[str] = DEFAULT_FORMATS,
) -> dict[str, str]:
    """Draws figures and writes them into a folder that exists; one that fails costs no other.

    Args:
        folder: Where to.
        drawn: What draws them, by name without ending.
        formats: Endings of the files of each.

    Returns:
        Of each file that could not be written, the name and why, in one line.
    """
    return write_pictures(folder, dict(figure_writers(drawn, formats)))


class _DrawnOnce:
    """A figure for several files."""

    def __init__(self, draw: Callable[[], Figure], files: int) -> None:
        self._draw, self._left = draw, files
        self._figure: Figure | None = None

    def write(self, path: Path) -> Path:
        if self._figure is None:
            self._figure = self._draw()
            lay_out(self._figure)
        figure = self._figure
        self._left -= 1
        if self._left <= 0:
            self._figure = None
        _put(figure, path)  # into the file that `write_pictures` makes whole
        return path
