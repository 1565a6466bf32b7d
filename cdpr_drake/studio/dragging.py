"""Points dragged in the scene, and what follows them: workspace and tensions, in two lines.

`dragging.js` tells where a point is. While it is dragged all numbers follow; when it is let go,
that is one change of the document.
"""

from __future__ import annotations

from contextlib import suppress
from importlib.resources import files
from typing import Literal

import numpy as np
from nicegui import events, ui
from pydantic import BaseModel, FiniteFloat, NonNegativeInt, ValidationError

from cdpr_drake.studio.live_workspace import FINE, LiveWorkspace
from cdpr_drake.studio.session import Workbench

SCRIPT = files("cdpr_drake.studio").joinpath("dragging.js").read_text(encoding="utf-8")

MOVED = "studio_point"
"""Name of the script's event."""

EMPTY = (
    "Drag a point in the scene, or change a value below: the static workspace is drawn there, and "
    "follows."
)
HIDDEN = "The static workspace is not drawn while values change."


class _Moved(BaseModel):
    """What the script says: which point, its number, p_W [m], and whether it was let go."""

    kind: Literal["exit", "anchor"]
    number: NonNegativeInt
    at: tuple[FiniteFloat, FiniteFloat, FiniteFloat]
    done: bool = False


def add_point_dragging(bench: Workbench) -> None:
    """Lets the points in the page's scene be dragged."""

    def moved(event: events.GenericEventArguments) -> None:
        with suppress(ValidationError):  # the script says no such thing
            point = _Moved.model_validate(event.args)
            if point.number < len(bench.robot.value.cables):
                bench.drag_point(point.kind, point.number, np.array(point.at), point.done)

    ui.on(MOVED, moved)
    client = ui.context.client
    client.on_connect(lambda: ui.run_javascript(SCRIPT))
    if client.has_socket_connection:  # the panel is placed after the page has come
        ui.run_javascript(SCRIPT)


def busy_sign(bench: Workbench) -> None:
    """Places what turns while numbers are computed, but not with each step of a point dragged."""
    sign = ui.spinner(size="1.3em").props('role="status" aria-label="Computing"').mark("busy")

    def refresh() -> None:
        first = bench.answer is None and bench.problem is None
        sign.set_visibility(first or (bench.is_computing and not bench.is_dragged))

    refresh()
    bench.results.changed.subscribe(refresh)
    bench.answered.subscribe(refresh)


def live_workspace_bar(bench: Workbench) -> None:
    """Places the switch and the lines of what follows while a point or a value changes."""
    with ui.element("section").classes("studio-live").props('aria-label="What follows changes"'):
        with ui.row().classes("items-center"):
            switch = ui.switch("Workspace follows").props("dense").mark("live-workspace")
            busy_sign(bench)
        size = ui.label().classes("studio-soft").mark("live-size")
        pull = ui.label().classes("studio-soft").mark("live-tensions")

    def choose() -> None:
        if switch.value != bench.live.is_wanted:
            bench.live.want(bool(switch.value))
            refresh()

    def refresh() -> None:
        switch.value = bench.live.is_wanted
        size.text, pull.text = size_words(bench.live), tension_words(bench)

    refresh()
    switch.on_value_change(choose)
    bench.live.changed.subscribe(refresh)
    bench.answered.subscribe(refresh)


def size_words(live: LiveWorkspace) -> str:
    """How large the workspace is, or why there is none to see."""
    sketch = live.sketch
    if not live.is_wanted:
        return HIDDEN
    if sketch is None:
        return EMPTY
    if sketch.volume is None:
        return f"static workspace: {sketch.problem}"
    volume, grid = sketch.volume, " x ".join(str(count) for count in sketch.counts)
    how = "coarse" if sketch.poses < FINE else "refined"
    return (
        f"static workspace: {100.0 * volume.share:.1f} % of the grid's box, {volume.value:.4g} "
        f"{volume.unit} ({how}, {grid} poses, level platform)"
    )


def tension_words(bench: Workbench) -> str:
    """Least and largest tension at the pose, and what is wrong with them."""
    answer = bench.answer
    if answer is None:
        return "" if bench.problem is not None else "tensions at this pose: computing"
    tensions, cables = answer.tensions, answer.robot.cables
    if not np.any(np.isfinite(tensions)):
        return f"tensions at this pose: {answer.why_no_tensions or answer.status or 'none'}"
    low, high = int(np.nanargmin(tensions)), int(np.nanargmax(tensions))
    slack = [cable.name for cable, is_slack in zip(cables, answer.slack, strict=True) if is_slack]
    least, most = answer.robot.tension_limits()
    return (
        f"tensions at this pose: {tensions[low]:.2f} N ({cables[low].name}) to "
        f"{tensions[high]:.2f} N ({cables[high].name}), limits {least:g} to {most:g} N"
        + (f"; slack: {', '.join(slack)}" if slack else "")
    )
