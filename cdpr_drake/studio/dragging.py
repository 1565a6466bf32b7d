"""Points dragged in the scene, and what follows them: workspace and tensions, in two lines.

`dragging.js` tells where a point is. While it is dragged all numbers follow; when it is let go,
that is one change of the document.
"""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import numpy as np
from nicegui import events, ui

from cdpr_drake.arrays import Array
from cdpr_drake.studio.live_workspace import LiveWorkspace
from cdpr_drake.studio.panel import notify, on_page, show_errors
from cdpr_drake.studio.pose_answer import PoseAnswer
from cdpr_drake.studio.session import Workbench

SCRIPT = files("cdpr_drake.studio").joinpath("dragging.js").read_text(encoding="utf-8")

MOVED = "studio_point"
"""Name of the script's event."""

EMPTY = (
    "Drag a point in the scene, or change a value below: the static workspace is drawn there, and "
    "follows."
)
HIDDEN = "The static workspace is not drawn while values change."


def add_point_dragging(bench: Workbench) -> None:
    """Lets the points in the page's scene be dragged."""

    def moved(event: events.GenericEventArguments) -> None:
        with show_errors():
            point = _point(event.args, len(bench.robot.value.cables))
            words = bench.drag_point(*point) if point else ""
            if words:
                notify(words)

    ui.on(MOVED, moved)
    client = ui.context.client
    client.on_connect(lambda: ui.run_javascript(SCRIPT))
    if client.has_socket_connection:  # the panel is placed after the page has come
        ui.run_javascript(SCRIPT)


def _point(message: Any, count: int) -> tuple[str, int, Array, bool] | None:
    """Kind, number of the cable, p_W [m], and whether it was let go; None for what is no such."""
    if not isinstance(message, dict):
        return None
    kind, number = message.get("kind"), message.get("number")
    if kind not in ("exit", "anchor") or not isinstance(number, int) or not 0 <= number < count:
        return None
    try:
        p_W = np.array(message.get("at"), float)
    except (TypeError, ValueError):
        return None
    if p_W.shape != (3,) or not np.all(np.isfinite(p_W)):
        return None
    return kind, number, p_W, bool(message.get("done"))


def busy_sign(bench: Workbench) -> None:
    """Places what turns while numbers are computed, but not with each step of a point dragged."""
    sign = ui.spinner(size="1.3em").props('role="status" aria-label="Computing"').mark("busy")

    def refresh() -> None:
        first = bench.answer is None and bench.problem is None
        sign.set_visibility(first or (bench.is_computing and not bench.is_dragged))

    refresh()
    on_page(bench.results.changed, refresh)
    on_page(bench.answered, refresh)


def live_workspace_bar(bench: Workbench) -> None:
    """Places the switch and the lines of what follows while a point or a value changes."""
    with ui.element("section").classes("studio-live").props('aria-label="What follows changes"'):
        with ui.row().classes("items-center"):
            switch = ui.switch("Workspace follows", value=bench.live.is_wanted)
            switch.props("dense").mark("live-workspace")
            busy_sign(bench)
        size = ui.label().classes("studio-soft").mark("live-size")
        pull = ui.label().classes("studio-soft").mark("live-tensions")

    def choose() -> None:
        with show_errors():
            if switch.value != bench.live.is_wanted:
                bench.live.want(bool(switch.value))
            say_size()

    def say_size() -> None:
        switch.value = bench.live.is_wanted
        size.text = size_words(bench.live)

    def say_tensions() -> None:
        if bench.answer is not None:
            pull.text = tension_words(bench.answer)
        else:
            pull.text = "" if bench.problem else "tensions at this pose: computing"

    switch.on_value_change(choose)
    say_size()
    say_tensions()
    on_page(bench.live.changed, say_size)
    on_page(bench.answered, say_tensions)


def size_words(live: LiveWorkspace) -> str:
    """How large the workspace is, or why there is none to see."""
    if not live.is_wanted:
        return HIDDEN
    if live.problem:
        return f"static workspace: {live.problem}"
    if live.sketch is None:
        return EMPTY
    volume, grid = live.sketch.volume, " x ".join(str(count) for count in live.sketch.counts)
    how = "refined" if live.is_fine else "coarse"
    return (
        f"static workspace: {100.0 * volume.share:.1f} % of the grid's box, {volume.value:.4g} "
        f"{volume.unit} ({how}, {grid} poses, level platform)"
    )


def tension_words(answer: PoseAnswer) -> str:
    """Least and largest tension at the pose, and what is wrong with them."""
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
