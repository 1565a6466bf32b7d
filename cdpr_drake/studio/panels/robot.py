"""The robot panel."""

from __future__ import annotations

from nicegui import ui

from cdpr_drake.studio.panels.panel import on_page
from cdpr_drake.studio.workbench import Workbench


def robot_panel(bench: Workbench) -> None:
    """Shows which robot is worked on."""
    title = ui.label()

    def refresh() -> None:
        robot = bench.robot.value
        title.text = robot.title or robot.name

    refresh()
    on_page(bench.robot.changed, refresh)
