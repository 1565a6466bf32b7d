"""Distributes a wanted platform wrench over the cables, at a rate of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import Context, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.cable_geometry import PLANAR_ROWS
from cdpr_drake.models import RobotInPlant, tension_problem
from cdpr_drake.tension_batch import BATCH_METHODS, method_code
from cdpr_drake.tension_methods import distribute
from cdpr_drake.tension_problem import TensionProblem, TensionStatus
from cdpr_drake.tension_qp_kernel import FEASIBLE, workspace_shape
from cdpr_drake.tension_step import update_tensions, wrench_matrix_at


class TensionDistributor(LeafSystem):
    """Finds tensions within limits that put a wanted wrench on the platform.

    ============== ========= ===== ===========================================================
    port           type      unit  meaning
    ============== ========= ===== ===========================================================
    platform_state vector    m     in, as `CableForces` takes it
    desired_wrench vector(6) Nm, N in, F_P_W about Po that the cables shall put on the platform
    tensions       vector(m) N     out, within limits, in cable order
    feasible       vector(1) -     out, 1 while the last request was met, else 0
    failures       vector(1) -     out, how many requests were not met so far
    ============== ========= ===== ===========================================================

    Samples its inputs at a rate of its own; put it after a `PoseTracking`, or a `ComputedTorque`
    without rate, or it reads the wrench of the period before. A request that cannot be met, or
    that the method misses, leaves the tensions of the last one that was met; before the first they
    are the lower limits.
    """

    def __init__(
        self,
        in_plant: RobotInPlant,
        method: str = "quadratic_program",
        limits: tuple[float, float] | None = None,
        rate: float = 1000.0,
        reference: Array | None = None,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant.
            method: A name of `tension_methods.METHODS`; those of `tension_batch.BATCH_METHODS` run
                as kernels.
            limits: Smallest and largest tension [N]; None: the robot's.
            rate: Updates per second [Hz].
            reference: Wanted tensions, shape (m,) [N], for `reference_program`.

        Raises:
            TensionProblemError: Unknown method, limits that make no sense, or a method that the
                robot's redundancy excludes.
        """
        super().__init__()
        robot, plant = in_plant.robot, in_plant.plant
        # What `distribute` would refuse at every step, it refuses here.
        home = tension_problem(robot, robot.home.transform(), limits=limits, reference=reference)
        distribute(home, method)
        n, m = home.W.shape
        self._method = method
        self._code = method_code(method) if method in BATCH_METHODS else None
        self._reference = home.reference
        self._bounds = np.vstack([home.lower, home.upper, np.zeros(m)])
        self._rows = list(PLANAR_ROWS) if robot.is_planar() else slice(None)
        self._cables = robot.packed_cables()
        self._height = 0.0 if robot.plane_height is None else float(robot.plane_height)
        self._work, self._W, self._t = (
            np.empty(workspace_shape(n, m)),
            np.empty((n, m)),
            np.empty(m),
        )
        size = plant.num_multibody_states(in_plant.model_instance)
        # Looked up once: these are called at every step of control.
        self._state = self.DeclareVectorInputPort("platform_state", size).Eval
        self._wrench = self.DeclareVectorInputPort("desired_wrench", 6).Eval
        self._tensions = self.DeclareDiscreteState(home.lower)
        self._feasible = self.DeclareDiscreteState(1)
        self._failures = self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        self.DeclareStateOutputPort("tensions", self._tensions)
        self.DeclareStateOutputPort("feasible", self._feasible)
        self.DeclareStateOutputPort("failures", self._failures)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        values = state.get_mutable_value
        if self._code is None:
            self._search(self._state(context), self._wrench(context), values)
            return
        code = update_tensions(
            self._code,
            self._state(context),
            self._wrench(context),
            self._cables,
            self._height,
            self._bounds,
            self._work,
            self._W,
            self._t,
            values(self._tensions),
            values(self._feasible),
        )
        if code != FEASIBLE:
            values(self._failures)[0] += 1.0

    def _search(self, state: Array, desired: Array, values: Callable[..., Array]) -> None:
        """The way of the methods without a kernel; leaves what they computed in `_t`."""
        wrench_matrix_at(state, self._cables, self._height, self._W)
        wrench = -desired[self._rows]
        problem = TensionProblem(self._W, wrench, self._bounds[0], self._bounds[1], self._reference)
        solution = distribute(problem, self._method)
        self._t[:] = solution.tensions
        met = solution.status == TensionStatus.FEASIBLE
        values(self._feasible)[0] = float(met)
        if met:
            values(self._tensions)[:] = solution.tensions
        else:
            values(self._failures)[0] += 1.0
