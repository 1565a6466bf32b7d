"""Workspaces of robots: kinds and measures by name, the question, the sweep, figures, the page.

`KINDS` and `MEASURES` are the tables; a new kind is a row. Figures are imported when they are asked
for.

Source: Gazebo thesis 2.6; servoing thesis 1.2.2 and 1.3.3.
"""

from typing import TYPE_CHECKING, Any

from cdpr_drake.analyses.workspaces.boxes import (
    BoxSearch,
    agreement_numbers,
    agreements,
    box_numbers,
    box_search,
    certified_boxes,
    load_boxes,
    save_boxes,
    write_boxes,
)
from cdpr_drake.analyses.workspaces.conditions import (
    KINDS,
    MEASURES,
    ConditionsTask,
    Kind,
    Measure,
    PoseConditions,
    Poses,
)
from cdpr_drake.analyses.workspaces.drawings import WorkspaceDrawings
from cdpr_drake.analyses.workspaces.files import load_obstacles, load_wrench_set
from cdpr_drake.analyses.workspaces.question import (
    RULES,
    Asked,
    WorkspaceQuestion,
    make_workspace_question,
    pose_conditions,
    surroundings,
)
from cdpr_drake.analyses.workspaces.regions import (
    HullBound,
    hull_bound,
    hull_numbers,
    load_hull,
    question_hull,
    save_hull,
)
from cdpr_drake.analyses.workspaces.results import (
    RobotWorkspace,
    WorkspaceRun,
    load_robot_workspace,
    robot_workspace,
)
from cdpr_drake.analyses.workspaces.scene import (
    box_solids,
    hull_solid,
    workspace_page,
    workspace_solids,
)

if TYPE_CHECKING:
    from cdpr_drake.analyses.workspaces.figures import (
        boxes_figure,
        planes_figure,
        workspace_pictures,
        wrench_set_figure,
    )

__all__ = [
    "KINDS",
    "MEASURES",
    "RULES",
    "Asked",
    "BoxSearch",
    "ConditionsTask",
    "HullBound",
    "Kind",
    "Measure",
    "PoseConditions",
    "Poses",
    "RobotWorkspace",
    "WorkspaceDrawings",
    "WorkspaceQuestion",
    "WorkspaceRun",
    "agreement_numbers",
    "agreements",
    "box_numbers",
    "box_search",
    "box_solids",
    "boxes_figure",
    "certified_boxes",
    "hull_bound",
    "hull_numbers",
    "hull_solid",
    "load_boxes",
    "load_hull",
    "load_obstacles",
    "load_robot_workspace",
    "load_wrench_set",
    "make_workspace_question",
    "planes_figure",
    "pose_conditions",
    "question_hull",
    "robot_workspace",
    "save_boxes",
    "save_hull",
    "surroundings",
    "workspace_page",
    "workspace_pictures",
    "workspace_solids",
    "wrench_set_figure",
    "write_boxes",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name in ("boxes_figure", "planes_figure", "wrench_set_figure", "workspace_pictures"):
        from cdpr_drake.analyses.workspaces import figures

        return getattr(figures, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
