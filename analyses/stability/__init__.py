"""Workspaces of stability: the question, the sweep over a grid, figures and the page.

Source: servoing thesis 3.3.
"""

from cdpr_drake.analyses.stability.defaults import load_bounds, workspace_defaults
from cdpr_drake.analyses.stability.figures import (
    cell_edges,
    curves_figure,
    even_choice,
    plane_axes,
    planes_figure,
    stability_pictures,
)
from cdpr_drake.analyses.stability.from_scenario import scenario_task
from cdpr_drake.analyses.stability.question import (
    CameraTask,
    StabilityQuestion,
    make_question,
    stability_case,
)
from cdpr_drake.analyses.stability.scene import (
    held_picture,
    home_tensions,
    scene_page,
    stability_solids,
)
from cdpr_drake.analyses.stability.static_feasible import static_case
from cdpr_drake.analyses.stability.tasks import SampledTask, StabilityTask, VerdictsTask
from cdpr_drake.analyses.stability.workspaces import (
    KINDS,
    StabilityRun,
    StabilityWorkspaces,
    load_workspaces,
    stability_workspaces,
)

__all__ = [
    "KINDS", "CameraTask", "SampledTask", "StabilityQuestion", "StabilityRun", "StabilityTask",
    "StabilityWorkspaces", "VerdictsTask", "cell_edges", "curves_figure", "even_choice",
    "held_picture", "home_tensions", "load_bounds", "load_workspaces", "make_question",
    "plane_axes", "planes_figure", "scenario_task", "scene_page", "stability_case",
    "stability_pictures", "stability_solids", "stability_workspaces", "static_case",
    "workspace_defaults",
]  # fmt: skip
