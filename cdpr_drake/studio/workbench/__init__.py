"""What a browser session works on, without the page: documents, files, pose, scene.

A `Workbench` has the robot as a `Document`: the text of a robot file with undo and redo, checked
by the same validation as `cdpr check`, and never changed by what is not accepted. `WorkingFolder`
is the only place that is read from and written to. `Signal` tells the pages that show a workbench
what has changed. Numbers and the scene belong to one thread, the `Calculator`'s: who draws says
`bench.draw(lambda scene: ...)` and gets a `RobotScene`, whose `meshcat` takes calls there only.
Every result that a panel shows has a `Subject`, the robot and pose that it is about:
`bench.results` knows all of them, and says which are about something else than what is open now.
"""

from cdpr_drake.studio.workbench.calculator import Calculator
from cdpr_drake.studio.workbench.document import Document
from cdpr_drake.studio.workbench.pose_answer import PoseAnswer, RobotQuestions
from cdpr_drake.studio.workbench.pose_axes import PoseAxis, axis_values, pose_at, pose_axes
from cdpr_drake.studio.workbench.robot_files import (
    LARGEST_UPLOAD,
    MOST_UPLOADS,
    UPLOADS,
    OpenedRobot,
    RobotFiles,
    export_formats,
    exported,
)
from cdpr_drake.studio.workbench.scene import ANCHORS, EXITS, RobotScene
from cdpr_drake.studio.workbench.session import POSE_NUMBERS, USUAL_ROBOT, Workbench
from cdpr_drake.studio.workbench.signal import Signal
from cdpr_drake.studio.workbench.subject import Results, Subject, subject_of
from cdpr_drake.studio.workbench.working_folder import WorkingFolder
from cdpr_drake.studio.workbench.yaml_edit import flow, has, with_item, with_value, without_item

__all__ = [
    "ANCHORS",
    "EXITS",
    "LARGEST_UPLOAD",
    "MOST_UPLOADS",
    "POSE_NUMBERS",
    "UPLOADS",
    "USUAL_ROBOT",
    "Calculator",
    "Document",
    "OpenedRobot",
    "PoseAnswer",
    "PoseAxis",
    "Results",
    "RobotFiles",
    "RobotQuestions",
    "RobotScene",
    "Signal",
    "Subject",
    "Workbench",
    "WorkingFolder",
    "axis_values",
    "export_formats",
    "exported",
    "flow",
    "has",
    "pose_at",
    "pose_axes",
    "subject_of",
    "with_item",
    "with_value",
    "without_item",
]  # fmt: skip
