"""What is in a log, as a figure: each kind of column over time or rows, and the gaps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from cdpr_drake.analyses.logs.recorded_log import (
    ANGLES,
    COMMANDED,
    ESTIMATED,
    GAP,
    LENGTH,
    MOTOR,
    POSITION,
    QUATERNION,
    SWIVEL,
    TENSION,
    RecordedLog,
)
from cdpr_drake.analyses.visualization.curves import draw_curve, phase_of, shade
from cdpr_drake.analyses.visualization.figure_style import few_ticks, new_figure, styled
from cdpr_drake.arrays import Array
from cdpr_drake.palette import nth_look

_KINDS = (
    (LENGTH, "cable length", "m"),
    (MOTOR, "motor angle", "rad"),
    (TENSION, "tension", "N"),
    (SWIVEL, "swivel angle", "rad"),
)

MOST_PANELS = 6

DENSE = 200
"""Logs of fewer rows are drawn with a point a row."""


def log_figure(log: RecordedLog) -> Figure:
    """All kinds of columns of a log, one below the other.

    Args:
        log: The log.
    """
    panels = _panels(log)[:MOST_PANELS]
    time = log.time
    t: Array = np.arange(1, log.count + 1, dtype=float) if time is None else time
    figure, all_axes = new_figure(
        max(len(panels), 1), 1, (9.0, 1.2 + 2.1 * max(len(panels), 1)),
        f"{log.path.name}: {log.row_report().words()}",
    )  # fmt: skip
    row_axes = np.atleast_1d(all_axes)
    with styled():
        for axes, (title, unit, headers) in zip(row_axes, panels, strict=False):
            for k, header in enumerate(headers):
                _draw(axes, t, log.columns[header], k, len(headers), header)
            if time is not None and len(time) > 1:
                steps = np.diff(time)
                wide = np.append(steps > GAP * np.median(steps), False)
                shade(axes, t, wide, "gap in time" if wide.any() else None)
            axes.set_ylabel(f"{title} [{unit}]")
            axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
            few_ticks(axes.yaxis)
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


def _panels(log: RecordedLog) -> list[tuple[str, str, Sequence[str]]]:
    """Title, unit and headers of each panel."""
    found: list[tuple[str, str, Sequence[str]]] = []
    for ending, title, unit in _KINDS:
        headers = log.of_cables(ending)
        if headers:
            found.append((title, unit, headers))
    for prefix, title in (("", "position"), (ESTIMATED, "estimated"), (COMMANDED, "commanded")):
        headers = [f"{prefix}{h}" for h in POSITION if f"{prefix}{h}" in log.columns]
        if headers:
            found.append((title, "m", headers))
    for names, title, unit in ((ANGLES, "turn", "rad"), (QUATERNION, "quaternion", "-")):
        headers = [h for h in names if h in log.columns]
        if headers:
            found.append((title, unit, headers))
    return found
