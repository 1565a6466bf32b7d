"""Programs about motion: the fastest law of time along a path, free paths, rest without swing.

A motion along a path s(t) asks the cables for tensions that are linear in u = d2s/dt2 and
x = (ds/dt)^2, with the redundancy as free variables; limits of tensions, torques, cable speeds and
accelerations make a convex set of (u, x) at every point of the path. Poses are X_WP; derivatives of
a path are spatial vectors (rotation, translation) in W, per metre of s.

Source: Bobrow, Dubowsky and Gibson, 1985; Pham and Stasse, 2015; Pham and Pham, 2018; Verscheure et
al., Time-optimal path tracking for robots: a convex optimization approach, 2009, in tests.
"""

from cdpr_drake.planning.failures import check_held, stuck
from cdpr_drake.planning.free_path import KNOTS, FreePathProgram
from cdpr_drake.planning.free_path_solution import FreePathSolution
from cdpr_drake.planning.free_path_terms import Capsule
from cdpr_drake.planning.horizon import Horizon, View
from cdpr_drake.planning.input_shaping import (
    NO_SHAPER,
    SHAPERS,
    Shaper,
    make_shaper,
    shaped_share,
)
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import MotionSamples, PathTask, sample_motion
from cdpr_drake.planning.path_timing import STATIONS, PathPlan, plan_along_path

__all__ = [
    "KNOTS", "NO_SHAPER", "SHAPERS", "STATIONS", "Capsule", "FreePathProgram",
    "FreePathSolution", "Horizon", "MotionLimits", "MotionSamples", "PathPlan", "PathTask",
    "Shaper", "View", "check_held", "make_shaper", "plan_along_path", "sample_motion",
    "shaped_share", "stuck",
]  # fmt: skip
