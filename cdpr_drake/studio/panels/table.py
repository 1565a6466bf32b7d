"""The table of panels, in the order of the tabs."""

from __future__ import annotations

from cdpr_drake.studio.panels.logs import LOG, logs_panel
from cdpr_drake.studio.panels.panel import Panel
from cdpr_drake.studio.panels.pose import pose_panel
from cdpr_drake.studio.panels.robot import robot_panel
from cdpr_drake.studio.panels.run import COMPARED, RUN, run_panel
from cdpr_drake.studio.panels.studies import STUDY, studies_panel
from cdpr_drake.studio.panels.workspace import WORKSPACES, workspace_panel
from cdpr_drake.studio.workbench.session import POSE_NUMBERS

PANELS = {
    panel.name: panel
    for panel in (
        Panel("robot", "Robot", "precision_manufacturing", {}, robot_panel),
        Panel("pose", "Pose", "open_with", {POSE_NUMBERS: "Numbers"}, pose_panel),
        Panel("workspace", "Workspace", "view_in_ar", {WORKSPACES: "Workspaces"}, workspace_panel),
        Panel(
            "run",
            "Run",
            "play_circle",
            {RUN: "The run that is shown", COMPARED: "The run behind it"},
            run_panel,
        ),
        Panel("logs", "Logs", "timeline", {LOG: "The comparison"}, logs_panel),
        Panel("studies", "Studies", "science", {STUDY: "Studies"}, studies_panel),
    )
}
"""Panels by name."""
