"""Tension distribution as a service: a pose and a wrench in, tensions out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from cdpr_drake.errors import BridgeError, accepted_names
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.sections.remote.messages import shown, vector
from cdpr_drake.tensions.methods import distribute

UNIT = 1e-6
"""How far the norm of a quaternion may be from 1: single precision has passed."""

LONGEST_NAME = 100
"""Of a method [characters]; what is longer is shown in part."""

FIELDS = ("do", "pose", "wrench", "limits", "method")


def tension_service(
    robot: Robot,
    *,
    limits: tuple[float, float] | None,
    method: str,
    cables: CableSet | None = None,
) -> Callable[[Mapping[str, Any]], dict[str, Any]]:
    """What answers the request "distribute" of `cdpr_drake.sections.remote`.

    Args:
        robot: The robot.
        limits: Smallest and largest tension where the request has none [N]; None: the robot's.
        method: Method where the request has none.
        cables: The cables; None: the robot's, pulleys included.

    Returns:
        A function of a request, that gives "feasible", "status" and "tensions", shape (m,) [N]. It
        raises BridgeError for what is no request, and what `tension_problem` and `distribute` do.
    """

    def answer(request: Mapping[str, Any]) -> dict[str, Any]:
        unknown = [name for name in request if name not in FIELDS]
        if unknown:
            known = accepted_names(unknown[0], FIELDS[1:])
            raise BridgeError(f"distribute: found {shown(unknown[0])}; {known}")
        row = vector("pose", request.get("pose"), 7)
        norm = math.hypot(*row[:4])  # NumPy's overflows, and warns
        if abs(norm - 1.0) > UNIT:
            raise BridgeError(f"pose: found a quaternion of norm {norm:g}; accepted: 1")
        bounds = limits
        if "limits" in request:
            low, high = vector("limits", request["limits"], 2)
            bounds = (float(low), float(high))
        wanted = request.get("method", method)
        if not isinstance(wanted, str) or len(wanted) > LONGEST_NAME:
            raise BridgeError(f"method: found {shown(wanted)}; accepted: a name")
        X_WP = pose_from_row(row)
        problem = tension_problem(robot, X_WP, limits=bounds, cables=cables)
        if "wrench" in request:
            # The cables put W t on the platform, which is in balance with -F.
            wrench = -vector("wrench", request["wrench"], 6)
            R_WP = X_WP.rotation().matrix()
            problem = replace(problem, wrench=robot.motion_type().components(wrench, R_WP))
        found = distribute(problem, wanted)
        status = str(found.status)
        return {"feasible": status == "feasible", "status": status, "tensions": found.tensions}

    return answer
