"""What is in a log, as a figure: each kind of column over time or rows, and the gaps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.calibration import columns
from cdpr_drake.analyses.frame.figures import (
    draw_curve,
    few_ticks,
    panels,
    phase_of,
    shade,
    styled,
)
from cdpr_drake.analyses.logs.recorded_log import (
    ANGLES,
    COMMANDED,
    ESTIMATED,
    GAP,
    POSITION,
    QUATERNION,
    TIME,
    RecordedLog,
    quantity,
)
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look

_KINDS = {
    columns.LENGTHS: "cable length", columns.ANGLES: "motor angle", columns.TENSIONS: "tension",
    columns.SWIVELS: "swivel angle", columns.TORQUES: "motor torque",
}  # fmt: skip
"""Titles of what is measured of cables."""

NO_UNIT = "unit not said"

MOST_PANELS = 6

DENSE = 200
"""Logs of fewer rows are drawn with a point a row."""

MOST_NAMED = 8
"""So many columns that are not drawn are named."""


def log_figure(log: RecordedLog) -> Figure:
    """All kinds of columns of a log, one below the other; what is not drawn is said."""
    kinds = _panels(log)[:MOST_PANELS]
    drawn = {TIME, *(header for _, _, headers in kinds for header in headers)}
    left = [header for header in log.columns if header not in drawn]
    time = log.time
    t: Array = np.arange(1, log.count + 1, dtype=float) if time is None else time
    title = "\n".join([f"{log.path.name}: {log.row_report().words()}", *_not_drawn(left)])
    size = (9.0, 1.2 + 2.1 * max(len(kinds), 1))
    figure, row_axes = panels(len(kinds), 1, size, title)
    with styled():
        for axes, (title, unit, headers) in zip(row_axes, kinds, strict=False):
            for k, header in enumerate(headers):
                _draw(axes, t, log.columns[header], k, len(headers), header)
            if time is not None and len(time) > 1:
                steps = np.diff(time)
                wide = np.append(steps > GAP * np.median(steps), False)
                shade(axes, t, wide, "gap in time" if wide.any() else None)
            axes.set_ylabel(f"{title} [{unit}]")
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
            few_ticks(axes.yaxis)
            if time is None:
                axes.set_xlim(0.5, log.count + 0.5)
            else:
                axes.set_xlim(float(t[0]), float(t[-1]) if len(t) > 1 else float(t[0]) + 1.0)
        row_axes[-1].set_xlabel("time [s]" if time is not None else "row")
    return figure


def _draw(axes: object, t: Array, values: Array, k: int, count: int, header: str) -> None:
    look, label = nth_look(k), header.rpartition("_")[0] or header
    if len(t) <= DENSE:
        axes.plot(  # type: ignore[attr-defined]
            t, values, color=look.color, linestyle="none", marker=look.marker or "o",
            markersize=4.5, markerfacecolor="white", label=label,
        )  # fmt: skip
    else:
        draw_curve(axes, t, values, look, label, phase=phase_of(k, count))


def _not_drawn(headers: Sequence[str]) -> list[str]:
    """A line that names columns, where there are any."""
    if not headers:
        return []
    more = len(headers) - MOST_NAMED
    return [f"not drawn: {', '.join(headers[:MOST_NAMED])}" + (f" and {more} more" * (more > 0))]


def _panels(log: RecordedLog) -> list[tuple[str, str, Sequence[str]]]:
    """Title, unit and headers of each panel."""
    found = _cable_panels(log)
    for prefix, title in (("", "position"), (ESTIMATED, "estimated"), (COMMANDED, "commanded")):
        headers = [f"{prefix}{h}" for h in POSITION if f"{prefix}{h}" in log.columns]
        if headers:
            found.append((title, "m", headers))
    for names, title, unit in ((ANGLES, "turn", "rad"), (QUATERNION, "quaternion", "-")):
        headers = [h for h in names if h in log.columns]
        if headers:
            found.append((title, unit, headers))
    return found


def _cable_panels(log: RecordedLog) -> list[tuple[str, str, Sequence[str]]]:
    """Panels of what was measured of cables, whatever units a file that was read as it is has."""
    found: dict[tuple[str, str], list[str]] = {}
    for what, title in _KINDS.items():
        for header in log.columns:
            if _kind(header) == what:
                found.setdefault((title, quantity(header) or NO_UNIT), []).append(header)
    return [(title, unit, headers) for (title, unit), headers in found.items()]


def _kind(header: str) -> str:
    """What a column measures of a cable, whatever the cable's name; empty: nothing."""
    if header.startswith((COMMANDED, ESTIMATED)):
        return ""
    words = columns.split_unit(header)[0].split("_")
    # The first or the last of the words is the cable: A_motor_deg, or motor_A_deg.
    names = [name for name in (words[0], words[-1]) if name and len(words) > 1]
    known = columns.read_header(header, names, 1)
    return "" if known is None else known.what
