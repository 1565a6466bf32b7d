"""The command `cdpr plan`: one of the verbs that plan a motion."""

from __future__ import annotations

from cdpr_drake.analyses.frame.verb import either
from cdpr_drake.analyses.frame.words import Switch
from cdpr_drake.analyses.planning.free_plan import plan_free_motion
from cdpr_drake.analyses.planning.path_plan import plan_path
from cdpr_drake.analyses.planning.proven_plan import plan_proven_motion


@either(plan_path, free=plan_free_motion, proven=plan_proven_motion)
def plan(*, free: Switch = False, proven: Switch = False) -> None:
    """Plans a motion within limits of tensions and winches: on a path, a free one, or a proven one.

    Writes motion.csv, summary.json and figures; scenarios of dynamic control track the motion by
    trajectory.file. If there is no motion, the exit code is 2 and the message names the place and
    the cable.

    Args:
        free: The path is free: from one pose to another, no path given.
        proven: The path is free, and proven at every instant: in sets of poses that are proven.
    """
