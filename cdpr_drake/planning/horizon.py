"""Predictive control: a quadratic program over the time ahead, that keeps limits while it tracks.

Offsets from a reference motion, (turn, way) in W, and of its velocity follow accelerations that are
constant for a step; the wrench that these need, linearised at the reference (at the first step at
the platform itself), is what tensions within their limits give. So where the reference asks for
more than the cables can, the platform falls behind ahead of time and as little as can be, instead
of when it is too late.

Source: Rawlings, Mayne, Diehl, Model Predictive Control, 2017, chapter 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.solvers import ClarabelSolver, MathematicalProgram, OsqpSolver

from cdpr_drake.arrays import Array
from cdpr_drake.control.task_space import floating_wrench
from cdpr_drake.errors import PlanningError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.poses import cross_matrix, pose_row, rotation_vector
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.trajectories.pose_trajectory import MOTION_SIZE, PoseTrajectory

FEWEST, MOST = 2, 100
"""Numbers of steps that are accepted."""

SOLVERS = (ClarabelSolver, OsqpSolver)
"""In the order in which they are taken."""

TIME_CONSTANT = 0.05
"""How fast offsets shall go [s]: velocities count by it, accelerations by its square."""

OFFSET = 1e-3
"""An offset that costs 1 in a step [m]."""

EFFORT, TENSION_SHARE, OUTSIDE = 0.05, 1e-4, 1e4
"""Weights of accelerations off the reference, of tensions as shares of the largest, and of what
speeds and view may miss of their limits: a soft constraint, since a reference may lie outside."""


@dataclass(frozen=True, eq=False)
class View:
    """What a camera on the platform shall keep in view.

    Attributes:
        X_PC: Pose of the camera C, z forward [m].
        slopes: Tangents of half of the view's angles along x and y of C.
        p_WQ: The points, shape (3, p) [m].
    """

    X_PC: RigidTransform
    slopes: tuple[float, float]
    p_WQ: Array

    def rows(self, X_WP: RigidTransform) -> tuple[Array, Array]:
        """A, shape (4 p, 6), and c with A (turn, way) + c >= 0 in view, to first order [m]."""
        R_PC, p_PC = self.X_PC.rotation().matrix(), self.X_PC.translation()
        R_CW = R_PC.T @ X_WP.rotation().matrix().T
        signs = np.array([
            [-1.0, 0.0, self.slopes[0]], [1.0, 0.0, self.slopes[0]],
            [0.0, -1.0, self.slopes[1]], [0.0, 1.0, self.slopes[1]],
        ])  # fmt: skip
        A, c = [], []
        for Q in np.asarray(self.p_WQ, float).T:
            d = Q - X_WP.translation()
            place = R_CW @ d - R_PC.T @ p_PC
            A.append(signs @ R_CW @ np.hstack([cross_matrix(d), -np.eye(3)]))
            c.append(signs @ place)
        return np.vstack(A), np.concatenate(c)


class Horizon:
    """The program of one robot and one reference motion.

    Attributes:
        steps: Steps ahead.
        period: Of a step [s].
    """

    def __init__(
        self,
        task: PathTask,
        reference: PoseTrajectory,
        steps: int,
        period: float,
        view: View | None = None,
    ) -> None:
        """With the robot's limits of tensions and cable speeds.

        Raises:
            PlanningError: A number is not accepted, or no solver is there.
        """
        if not FEWEST <= steps <= MOST:
            raise PlanningError(f"horizon: found {steps} steps; accepted: {FEWEST} to {MOST}")
        if not (np.isfinite(period) and period > 0.0):
            raise PlanningError(f"horizon: period: found {period:g} s; accepted: above 0")
        there = [kind() for kind in SOLVERS if kind().available() and kind().enabled()]
        if not there:
            raise PlanningError("horizon: found no solver; accepted: Clarabel or OSQP in Drake")
        self.steps, self.period = steps, period
        self._task, self._reference, self._view = task, reference, view
        self._solver, self._rows = there[0], list(task.dynamics.motions)
        self._dynamics, self._still = task.dynamics.packed(), np.zeros(4)
        squares = np.sum(task.cables.p_PB**2, axis=0)
        arm = float(np.sqrt(np.mean(squares))) or 1.0
        self._scale = np.array([arm] * 3 + [1.0] * 3)[self._rows]

    def tensions(self, time: float, X_WP: RigidTransform, V_WP: Array) -> Array | None:
        """Tensions for the next step, or None where the program was not solved.

        Args:
            time: Time [s].
            X_WP: Pose of the platform [m].
            V_WP: Its velocity, shape (6,) [rad/s, m/s].

        Returns:
            Shape (m,) [N], within the limits.
        """
        n, m, N, h = len(self._rows), self._task.cables.count, self.steps, self.period
        lim = self._task.limits
        motions = [self._reference.motion(time + k * h) for k in range(N + 1)]
        poses = [self._reference.pose(time + k * h) for k in range(N + 1)]
        program = MathematicalProgram()
        a = program.NewContinuousVariables(N, n, "a")
        t = program.NewContinuousVariables(N, m, "t")  # shares of the largest tension
        e = program.NewContinuousVariables(N, n, "e")
        v = program.NewContinuousVariables(N, n, "v")
        out = program.NewContinuousVariables(N, "out")
        program.AddBoundingBoxConstraint(lim.lower / lim.upper, 1.0, t.ravel())
        program.AddBoundingBoxConstraint(0.0, np.inf, out)
        eye = np.eye(n)
        offset = self._way(poses[0], X_WP)
        excess = (V_WP - motions[0][7:13])[self._rows]
        for k in range(N):
            X, motion = (X_WP, motions[0]) if k == 0 else (poses[k], motions[k])
            V = V_WP if k == 0 else motion[7:13]
            M, rest = self._needs(X, V)
            J = cable_jacobian(X, self._task.cables)
            W = -J.T[self._rows] * lim.upper
            program.AddLinearEqualityConstraint(
                np.hstack([W, -M]), rest, np.concatenate([t[k], a[k]])
            )
            speed, after = motions[k][7:13][self._rows], motions[k + 1][7:13][self._rows]
            way = h * speed - self._way(poses[k], poses[k + 1])
            A = np.hstack([eye, -0.5 * h * h * eye])
            B = np.hstack([eye, -h * eye])
            if k == 0:
                program.AddLinearEqualityConstraint(
                    A, offset + h * excess + way, np.concatenate([e[0], a[0]])
                )
                program.AddLinearEqualityConstraint(
                    B, excess + speed - after, np.concatenate([v[0], a[0]])
                )
            else:
                program.AddLinearEqualityConstraint(
                    np.hstack([A, -eye, -h * eye]), way,
                    np.concatenate([e[k], a[k], e[k - 1], v[k - 1]]),
                )  # fmt: skip
                program.AddLinearEqualityConstraint(
                    np.hstack([B, -eye]), speed - after, np.concatenate([v[k], a[k], v[k - 1]])
                )
            self._keep_within(program, poses[k + 1], motions[k + 1], e[k], v[k], out[k])
        wanted = np.array([motion[13:][self._rows] for motion in motions[:-1]])
        scale = np.tile(self._scale / OFFSET, N)
        for variables, weight, goal in (
            (e, scale, np.zeros(N * n)),
            (v, TIME_CONSTANT * scale, np.zeros(N * n)),
            (a, np.sqrt(EFFORT) * TIME_CONSTANT**2 * scale, wanted.ravel()),
            (t, np.full(N * m, np.sqrt(TENSION_SHARE)), np.zeros(N * m)),
        ):
            program.AddQuadraticErrorCost(np.diag(weight**2), goal, variables.ravel())
        program.AddLinearCost(np.full(N, OUTSIDE), 0.0, out)
        result = self._solver.Solve(program)
        if not result.is_success():
            return None
        return np.clip(lim.upper * np.asarray(result.GetSolution(t[0])), lim.lower, lim.upper)

    def _way(self, X: RigidTransform, Y: RigidTransform) -> Array:
        """(turn, way) from one pose to another in W, of what can move."""
        turn = rotation_vector(Y.rotation() @ X.rotation().inverse())
        return np.concatenate([turn, Y.translation() - X.translation()])[self._rows]

    def _needs(self, X: RigidTransform, V: Array) -> tuple[Array, Array]:
        """M and rest of the wrench M a + rest that the cables must give, of what can move."""
        state, desired = np.concatenate([pose_row(X), V]), np.zeros(MOTION_SIZE)
        desired[:13] = state
        wrenches = np.empty((7, 6))
        floating_wrench(state, desired, self._dynamics, self._still, wrenches[0])
        for k in range(6):
            desired[13:] = 0.0
            desired[13 + k] = 1.0
            floating_wrench(state, desired, self._dynamics, self._still, wrenches[1 + k])
        M = (wrenches[1:] - wrenches[0]).T
        return M[np.ix_(self._rows, self._rows)], wrenches[0][self._rows]

    def _keep_within(
        self, program: MathematicalProgram, X: RigidTransform, motion: Array, e: Array, v: Array,
        out: object,
    ) -> None:  # fmt: skip
        """Cable speeds and view at the end of a step, up to what `out` allows."""
        most = self._task.limits.cable_speed
        J = cable_jacobian(X, self._task.cables)
        rates, B = J @ motion[7:13] / most, J[:, self._rows] / most
        ones, variables = np.ones((len(B), 1)), np.array([*v, out])
        program.AddLinearConstraint(
            np.vstack([np.hstack([B, -ones]), np.hstack([-B, -ones])]),
            np.full(2 * len(B), -np.inf), np.concatenate([1.0 - rates, 1.0 + rates]), variables,
        )  # fmt: skip
        if self._view is None:
            return
        A, c = self._view.rows(X)
        rows = np.hstack([A[:, self._rows], np.ones((len(A), 1))])
        program.AddLinearConstraint(rows, -c, np.full(len(c), np.inf), np.array([*e, out]))
