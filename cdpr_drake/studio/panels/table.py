"""The table of panels, in the order of the tabs."""

from __future__ import annotations

from cdpr_drake.studio.panels.panel import Panel
from cdpr_drake.studio.panels.result_names import COMPARED, LOG, RUN, STUDY, WORKSPACES
from cdpr_drake.studio.workbench.session import POSE_NUMBERS

_ROOM = "cdpr_drake.studio.panels"

PANELS = {
    panel.name: panel
    for panel in (
        Panel("robot", "Robot", "precision_manufacturing", {}, f"{_ROOM}.robot", "robot_panel"),
        Panel(
            "pose", "Pose", "open_with", {POSE_NUMBERS: "Numbers"}, f"{_ROOM}.pose", "pose_panel"
        ),
        Panel(
            "workspace",
            "Workspace",
            "view_in_ar",
            {WORKSPACES: "Workspaces"},
            f"{_ROOM}.workspace",
            "workspace_panel",
        ),
        Panel(
            "run",
            "Run",
            "play_circle",
            {RUN: "The run that is shown", COMPARED: "The run behind it"},
            "cdpr_drake.studio.run",
            "run_panel",
        ),
        Panel(
            "logs",
            "Logs",
            "timeline",
            {LOG: "The comparison"},
            "cdpr_drake.studio.logs",
            "logs_panel",
        ),
        Panel(
            "studies",
            "Studies",
            "science",
            {STUDY: "Studies"},
            "cdpr_drake.studio.studies",
            "studies_panel",
        ),
    )
}
"""Panels by name."""
