"""Distributes a wanted platform wrench over the cables, at a rate of its own."""

from __future__ import annotations

import numpy as np
from pydrake.systems.framework import Context, DiscreteStateIndex, DiscreteValues, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.control.force_balance import FORCE, WRENCH, balanced_rows, force_problem
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_in_plant import RobotInPlant
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.control_step_kernel import TensionStep, update_tensions_at
from cdpr_drake.tensions.methods import method_for
from cdpr_drake.tensions.program_method import StepTimes
from cdpr_drake.tensions.quadratic_program_kernel import FEASIBLE, workspace_shape


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

    Samples its inputs at a rate of its own; the wrench must follow the state at once, as that of a
    `PoseTracking` does, or it reads that of the period before. A request that cannot be met, or
    that the method misses, leaves the tensions of the last one that was met; before the first they
    are the lower limits. Methods that relax, `slack_relaxed` and `log_barrier`, answer a request
    that cannot be met with tensions within the limits of which the wrench is nearest, or near it;
    it is counted as not met all the same. `log_barrier` starts at the tensions of the last step.
    By forces alone the moments of the wrench count for nothing, and the redundancy is larger by as
    many as there are.

    A method made by `TensionMethod.from_program` is built for this robot here, once, and starts at
    the tensions of the last step; `step_times` tells what it costs.

    Attributes:
        source: Whose tensions they are, in a word; empty: the method's.
    """

    source = ""

    def __init__(
        self,
        in_plant: RobotInPlant,
        method: str = "quadratic_program",
        limits: tuple[float, float] | None = None,
        rate: float = 1000.0,
        reference: Array | None = None,
        cables: CableSet | None = None,
        *,
        balance: str = WRENCH,
    ) -> None:
        """For a robot whose plant is finalized.

        Args:
            in_plant: The robot in its plant.
            method: A name of `tensions.METHODS`.
            limits: Smallest and largest tension [N]; None: the robot's.
            rate: Updates per second [Hz].
            reference: Wanted tensions, shape (m,) [N], for `reference_program`.
            cables: What it believes of the cables; None: the robot's, pulleys included.
            balance: What tensions balance, a name of `force_balance.BALANCES`.

        Raises:
            TensionProblemError: Unknown method, limits that make no sense, or a method that the
                robot's redundancy excludes.
        """
        super().__init__()
        robot, plant = in_plant.robot, in_plant.plant
        cables = robot.cable_set() if cables is None else cables
        home = tension_problem(
            robot, robot.home.transform(), limits=limits, reference=reference, cables=cables
        )
        motions = robot.servo_rows("tension distribution in a simulation")
        self._rows = list(balanced_rows(motions, balance))
        if balance == FORCE:
            home = force_problem(home, len(motions) - len(self._rows))
        n, m = home.W.shape
        self.rate = rate
        chosen = method_for(method, m - n, reference is not None)
        chosen.prepare(home, 1.0 / rate)
        self._method, self._chosen = method, chosen
        wanted = reference if chosen.needs_reference else None
        bounds = np.vstack([home.lower, home.upper, np.zeros(m) if wanted is None else wanted])
        self._step = TensionStep(
            chosen.compiled(m - n),
            cables.packed(),
            float(robot.plane_height or 0.0),
            bounds,
            home.scale_of_rows.copy(),
            room=workspace_shape(n, m),
            starts=chosen.starts,
        )
        self._W, self._t, self._table = self._step.W, self._step.t, self._step.table
        size = plant.num_multibody_states(in_plant.model_instance)
        # Looked up once: these are called at every step of control.
        self._state = self.DeclareVectorInputPort("platform_state", size).Eval
        self._wrench = self.DeclareVectorInputPort("desired_wrench", 6).Eval
        # As plain numbers, which are looked up faster.
        self._tensions = int(self.DeclareDiscreteState(home.lower))
        self._feasible = int(self.DeclareDiscreteState(1))
        self._failures = int(self.DeclareDiscreteState(1))
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        self.DeclareStateOutputPort("tensions", DiscreteStateIndex(self._tensions))
        self.DeclareStateOutputPort("feasible", DiscreteStateIndex(self._feasible))
        self.DeclareStateOutputPort("failures", DiscreteStateIndex(self._failures))

    @property
    def step_times(self) -> StepTimes | None:
        """How long the steps of a method made of a program took since the block was made.

        None: of kernels. One record for all blocks with this method, of which the last that was
        made says the period.
        """
        return self._chosen.step_times

    def packed(self) -> TensionStep:
        """Its constants, for loops that are compiled as a whole."""
        return self._step

    def _update(self, context: Context, state: DiscreteValues) -> None:
        values = state.get_mutable_value
        code = update_tensions_at(
            self._table,
            self._state(context),
            self._wrench(context),
            values(self._tensions),
            values(self._feasible),
        )
        if code != FEASIBLE:
            values(self._failures)[0] += 1.0
