"""Robots from the files of other tools."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.models.robot_exchange import ImportedRobot
from cdpr_drake.models.robot_exchange import import_robot as read_robot
from cdpr_drake.summaries import as_kind

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class DrawnImport(ImportedRobot):
    """An `ImportedRobot` that draws itself."""

    def plot(self) -> Figure:
        """The robot at its home pose."""
        from cdpr_drake.analyses.visualization.path_figures import poses_figure

        title = f"{self.robot.name} from {self.source.name}"
        return poses_figure(title, self.robot, {"home pose": self.robot.home.transform()})


@verb()
def import_robot(
    path: Path | str,
    *,
    name: str | None = None,
    model: str | None = None,
    cable_set: str | None = None,
) -> DrawnImport:
    """Reads a robot from a file of another tool.

    Args:
        path: CASPR's XML, folder or list of models, WireX' wcrfx, the Gazebo simulator's YAML,
            GRAB's JSON, SDFormat, URDF or MJCF.
        name: Name of the robot; None: the file's.
        model: Name of a model in a CASPR list.
        cable_set: Set of cables of a CASPR model; None: its default one.

    Returns:
        The robot, with what the file gave and lacked; `yaml()` is its robot file.

    Raises:
        RobotFileError: The file is not accepted; one line for each problem.
    """
    return as_kind(DrawnImport, read_robot(path, name=name, model=model, cable_set=cable_set))
