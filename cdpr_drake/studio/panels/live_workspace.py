"""What follows while a point is dragged or a value changed: workspace and tensions, in two lines.

The workspace is drawn in the scene; the lines say how large it is, and how tight the cables are.
"""

from __future__ import annotations

import numpy as np
from nicegui import ui

from cdpr_drake.studio.panel import on_page, show_errors
from cdpr_drake.studio.workbench.live_workspace import LiveWorkspace
from cdpr_drake.studio.workbench.pose_answer import PoseAnswer
from cdpr_drake.studio.workbench.session import Workbench

EMPTY = (
    "Drag a point in the scene, or change a value below: the static workspace is drawn there, and "
    "follows."
)
HIDDEN = "The static workspace is not drawn while values change."


def live_workspace_bar(bench: Workbench) -> None:
    """Places the switch and the lines."""
    with ui.element("section").classes("studio-live").props('aria-label="What follows changes"'):
        switch = ui.switch("Workspace follows", value=bench.live.is_wanted)
        switch.props("dense").mark("live-workspace")
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
        pull.text = "" if bench.answer is None else tension_words(bench.answer)

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
        return f"tensions at this pose: {answer.why_no_tensions or 'none'}"
    low, high = int(np.nanargmin(tensions)), int(np.nanargmax(tensions))
    slack = [cable.name for cable, is_slack in zip(cables, answer.slack, strict=True) if is_slack]
    least, most = answer.robot.tension_limits()
    return (
        f"tensions at this pose: {tensions[low]:.2f} N ({cables[low].name}) to "
        f"{tensions[high]:.2f} N ({cables[high].name}), limits {least:g} to {most:g} N"
        + (f"; slack: {', '.join(slack)}" if slack else "")
    )
