"""Exit points on rails, put where a task is possible or best."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.design.reconfiguration import (
    MARGIN,
    Around,
    RailSettings,
    Reconfiguration,
    load_rails,
    put_rails,
    reconfigured,
)
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.front.planning import PathPoses, Say, path_poses
from cdpr_drake.analyses.planning.robot_path_task import make_path
from cdpr_drake.analyses.workspaces.workspace_files import load_wrench_set
from cdpr_drake.errors import PlanningError, WrenchSetError
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose
from cdpr_drake.planning.reconfiguration import STARTS
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SAMPLES = 9
"""Poses of a path that are asked, where nobody says how many."""


class DrawnReconfiguration(Reconfiguration):
    """A `Reconfiguration` that draws itself."""

    def plot(self) -> Figure:
        """Rails, exit points before and after, and margins of the poses."""
        from cdpr_drake.analyses.design.rail_figures import rails_figure

        return rails_figure(self)


@verb()
def reconfigure(
    robot: Robot | str | Path,
    rails: Path | str | Sequence[RailSettings] | None,
    poses: Sequence[object] | PathPoses | Path | str,
    *,
    resist: SpatialSet | Path | str | None = None,
    goal: str = MARGIN,
    limits: tuple[float, float] | None = None,
    samples: int = SAMPLES,
    starts: int = STARTS,
    around: Around | None = None,
    say: Say | None = None,
) -> DrawnReconfiguration:
    """Puts exit points of a robot along rails so that poses are possible, or best; proves it.

    Args:
        robot: The robot, or its name or path.
        rails: A file of rails, or rails; None: those of the robot's file.
        poses: Poses, each as `as_pose` takes it [m]; or a file of a path, of which `samples` poses
            on straight lines and arcs are asked.
        resist: Wrenches on the platform to resist at each pose, or their file [N m, N].
        goal: margin: the largest margin of tensions to their limits; tension: the least largest
            tension.
        limits: Smallest and largest tension [N]; None: the robot's.
        samples: Poses of a path.
        starts: From how many places the program starts.
        around: Boxes of poses round each that are proven.
        say: Called with a line on what is done now.

    Raises:
        PlanningError: No position of the rails does it; names pose and wrench. Or something is not
            accepted.
        CdprError: A file cannot be read, or the robot cannot be asked.
    """
    loaded, groups = as_robot(robot, "reconfigure"), list[list[str]]()
    if rails is not None:
        source = str(rails) if isinstance(rails, str | Path) else "rails"
        settings = load_rails(Path(rails)) if isinstance(rails, str | Path) else list(rails)
        loaded = put_rails(loaded, settings, source)
        groups = [list(rail.cables) for rail in settings]
        own = {name for group in groups for name in group}
        for cable in loaded.cables:  # rails that are given take the place of all of the robot's
            if cable.rail is not None and cable.name not in own:
                cable.exit_point, cable.rail = cable.exit_point + cable.rail.shift(), None
    wrenches = load_wrench_set(Path(resist)) if isinstance(resist, str | Path) else resist
    try:
        found = reconfigured(
            loaded, _poses(loaded, poses, samples), wrenches, groups, goal=goal, limits=limits,
            starts=starts, around=around, say=say,
        )  # fmt: skip
    except WrenchSetError as problem:
        if wrenches is resist:
            raise
        raise WrenchSetError(f"{resist}: {problem}") from problem
    return DrawnReconfiguration(**vars(found))


def _poses(
    robot: Robot, poses: Sequence[object] | PathPoses | Path | str, samples: int
) -> list[RigidTransform]:
    if not isinstance(poses, PathPoses | Path | str):
        found = [as_pose(robot, pose) for pose in poses]
        if not found:
            raise PlanningError("poses: found none; accepted: at least 1")
        return found
    if samples < 2:
        raise PlanningError(f"samples: found {samples}; accepted: at least 2")
    read = path_poses(robot, poses)
    path = make_path(robot, read.poses, "rest", moves=read.moves)
    return [path.pose(float(s)) for s in np.linspace(0.0, path.length, samples)]
