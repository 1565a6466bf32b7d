"""Everything about a robot at one pose, by the functions that the commands ask."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.statics.robot_at_rest import RobotAtRest
from cdpr_drake.analyses.statics.static import solve_static
from cdpr_drake.analyses.tensions import applicable_methods, solve_tensions
from cdpr_drake.analyses.workspaces.conditions import MEASURES, PoseConditions, Poses
from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.studio.workbench.pose_answer import USUAL_METHOD, PoseAnswer
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.workspaces.cable_interference import PART_NAMES, clearances


class PoseSolver:
    """Knows one robot at many poses; what does not depend on the pose is computed once."""

    def __init__(self, robot: Robot) -> None:
        """Of a robot."""
        self.robot = robot

    @cached_property
    def _conditions(self) -> PoseConditions:
        return pose_conditions(self.robot)

    def at(
        self, X_WP: RigidTransform, method: str = USUAL_METHOD, reference: float | None = None
    ) -> PoseAnswer:
        """Everything at a pose.

        Args:
            X_WP: The pose.
            method: A name of `tensions.METHODS`.
            reference: Wanted tension of all cables [N], for methods that need one.
        """
        robot = self.robot
        found: dict[str, Any] = {"methods": [USUAL_METHOD], "status": "", "why_no_tensions": ""}
        tensions = np.full(len(robot.cables), np.nan)
        try:
            found |= self._tensions(X_WP, method, reference)
            tensions = found.pop("tensions", tensions)
        except CdprError as problem:
            found["why_no_tensions"] = str(problem)
        rest, why_no_rest = None, ""
        try:
            at_rest = solve_static(robot, X_WP)
            rest = at_rest if isinstance(at_rest, RobotAtRest) else None
        except CdprError as problem:
            why_no_rest = str(problem)
        try:
            lengths = cable_paths(X_WP, robot.cable_set()).lengths
        except CdprError:
            lengths = None
        with np.errstate(invalid="ignore"):
            slack = tensions <= 0.0  # straight cables pull or are slack
        return PoseAnswer(
            robot=robot, X_WP=X_WP, method=method, tensions=tensions, slack=slack, lengths=lengths,
            rest=rest, why_no_rest=why_no_rest, geometry=robot.geometry_words(), **found,
            **self._measures(X_WP),
        )  # fmt: skip

    def _tensions(
        self, X_WP: RigidTransform, method: str, reference: float | None
    ) -> dict[str, Any]:
        robot = self.robot
        if robot.is_underactuated():
            answer = solve_tensions(robot, X_WP).as_dict()
            off = [
                f"nothing balances {one['combination']}, {one['unbalanced']:.4g}"
                for one in answer["uncontrolled"]
                if answer["tensions_n"] is None
            ]
            made: dict[str, Any] = {"status": answer["status"], "why_no_tensions": "; ".join(off)}
            if answer["tensions_n"] is not None:
                made["tensions"] = np.array(answer["tensions_n"])
            return made
        wanted = None if reference is None else np.full(len(robot.cables), reference)
        problem = tension_problem(robot, X_WP, reference=wanted)
        methods = [
            name
            for name, one in METHODS.items()
            if name in applicable_methods(problem)
            or (one.needs_reference and one.takes(problem.redundancy))
        ]
        made = {"methods": methods}
        try:
            solution = distribute(problem, method)
        except CdprError as problem_found:
            return {**made, "why_no_tensions": str(problem_found)}
        return {**made, "status": str(solution.status), "tensions": solution.tensions}

    def _measures(self, X_WP: RigidTransform) -> dict[str, Any]:
        found: dict[str, Any] = {
            "capacity_margin": None, "clearance": None, "nearest": "", "notes": ""
        }  # fmt: skip
        try:
            about = self._conditions
            p, R = X_WP.translation()[np.newaxis], X_WP.rotation().matrix()[np.newaxis]
            here = Poses(0, 1, p, R)
            gaps = clearances(about.around, p, R)[0]
            if not np.all(np.isnan(gaps)):
                which = int(np.nanargmin(gaps))
                found |= {"clearance": float(gaps[which]), "nearest": PART_NAMES[which]}
            margin = float(MEASURES["capacity-margin"].value(about, here)[0])
            found["capacity_margin"] = margin if np.isfinite(margin) else None
        except CdprError as problem:
            found["notes"] = str(problem)
        return found
