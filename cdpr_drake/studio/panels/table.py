"""The table of panels, in the order of the tabs."""

from __future__ import annotations

from cdpr_drake.studio.panels.panel import Panel
from cdpr_drake.studio.panels.result_names import COMPARED, LOG, RUN, STUDY, WORKSPACES
from cdpr_drake.studio.session import POSE_NUMBERS

_ROOM = "cdpr_drake.studio.panels"

PANELS = {
    panel.name: panel
    for panel in (
        Panel("robot", "Robot", "precision_manufacturing", {}, f"{_ROOM}.robot", "robot_panel"),
        Panel(
            "pose",
            "Pose",
            "open_with",
            {POSE_NUMBERS: "Numbers"},
            "cdpr_drake.studio.pose",
            "pose_panel",
        ),
        Panel(
            "workspace",
            "Workspace",
            "view_in_ar",
            {WORKSPACES: "Workspaces"},
            "cdpr_drake.studio.workspace",
            "workspace_panel",
        ),
        Panel(
            "run",
            "Run",
            "play_circle",
            {RUN: "The run that is shown", COMPARED: "The run behind it"},
            f"{_ROOM}.run",
            "run_panel",
        ),
        Panel("logs", "Logs", "timeline", {LOG: "The comparison"}, f"{_ROOM}.logs", "logs_panel"),
        Panel(
            "studies", "Studies", "science", {STUDY: "Studies"}, f"{_ROOM}.studies", "studies_panel"
        ),
    )
}
"""Panels by name."""
