"""The table of panels, in the order of the tabs."""

from __future__ import annotations

from cdpr_drake.studio.panels.panel import Panel
from cdpr_drake.studio.panels.pose import pose_panel
from cdpr_drake.studio.panels.robot import robot_panel
from cdpr_drake.studio.panels.run import run_panel
from cdpr_drake.studio.panels.studies import studies_panel
from cdpr_drake.studio.panels.workspace import workspace_panel

PANELS = {
    panel.name: panel
    for panel in (
        Panel("robot", "Robot", "precision_manufacturing", robot_panel),
        Panel("pose", "Pose", "open_with", pose_panel),
        Panel("workspace", "Workspace", "view_in_ar", workspace_panel),
        Panel("run", "Run", "play_circle", run_panel),
        Panel("studies", "Studies", "science", studies_panel),
    )
}
"""Panels by name."""
