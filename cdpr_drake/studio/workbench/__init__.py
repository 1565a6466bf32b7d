"""What a browser session works on, without the page: documents, files, scene.

A `Workbench` has the robot as a `Document`: the text of a robot file with undo and redo, checked
by the same validation as `cdpr check`, and never changed by what is not accepted. `WorkingFolder`
is the only place that is read from and written to. `Signal` tells the pages that show a workbench
what has changed.
"""

from cdpr_drake.studio.workbench.document import Document, robot_document
from cdpr_drake.studio.workbench.session import USUAL_ROBOT, Workbench
from cdpr_drake.studio.workbench.signal import Signal
from cdpr_drake.studio.workbench.working_folder import WorkingFolder

__all__ = ["USUAL_ROBOT", "Document", "Signal", "Workbench", "WorkingFolder", "robot_document"]
