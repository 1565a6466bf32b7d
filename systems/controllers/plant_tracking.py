"""Computed torque and tension distribution for any plant on cables.

    tau* = M(q) (vdot_d + Kd (v_d - v) + Kp e) + C(q, v) v - tau_g(q)
    -J_l(q)' t + B u = tau*,    t_min <= t <= t_max

with e the way from q to the desired positions, as a velocity for one second. On rows that no motor
holds, the tensions must do all of it; motors do what is left on theirs.

Source: Siciliano et al., Robotics, 2009, 8.5.2; Lau, Oetomo and Halgamuge, Generalized modeling of
multilink cable-driven manipulators with arbitrary routing, IEEE T-RO 29(5), 2013, for J_l.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointIndex, MultibodyForces, QuaternionFloatingJoint
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteStateIndex,
    DiscreteValues,
    LeafSystem,
)

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import rows_of_joints, rows_of_motors
from cdpr_drake.models.plant_statics import plant_tension_problem
from cdpr_drake.tensions.methods import Distributor
from cdpr_drake.tensions.problem import TensionStatus


class PlantTracking(LeafSystem):
    """Asks for the generalized force that makes a plant follow desired positions.

    ==================== =============== ============= ==========================================
    port                 type            unit          meaning
    ==================== =============== ============= ==========================================
    plant_state          vector(nq + nv) m, rad        in, the plant's state port
    desired_state        vector(nq + nv) m, rad        in, positions and velocities to be followed
    desired_acceleration vector(nv)      m/s^2,rad/s^2 in, their accelerations
    desired_force        vector(nv)      N, N m        out, what cables and motors must do
    ==================== =============== ============= ==========================================

    Quaternions are taken by their signs as near to each other as they can be. The force follows
    the state at once; what holds it samples it.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        kp: Array | float,
        kd: Array | float,
        believed: MultibodyPlant | None = None,
    ) -> None:
        """For a finalized plant.

        Args:
            plant: The plant.
            kp: Gain of positions, shape (nv,) or one for all [1/s^2].
            kd: Gain of velocities, shape (nv,) or one for all [1/s].
            believed: What the controller believes of the plant, of the same coordinates; None: the
                plant itself.

        Raises:
            TensionProblemError: A gain is not accepted, or the believed plant has other
                coordinates.
        """
        super().__init__()
        model = believed or plant
        nq, nv = plant.num_positions(), plant.num_velocities()
        if (model.num_positions(), model.num_velocities()) != (nq, nv):
            raise TensionProblemError(
                f"believed: found {model.num_positions()} positions and {model.num_velocities()} "
                f"velocities; accepted: {nq} and {nv}, as the plant has"
            )
        self._plant, self._context = model, model.CreateDefaultContext()
        self._kp, self._kd = _gain("kp", kp, nv), _gain("kd", kd, nv)
        self._quaternions = [
            joint.position_start()
            for joint in map(model.get_joint, map(JointIndex, model.GetJointIndices()))
            if isinstance(joint, QuaternionFloatingJoint)
        ]
        self._state = self.DeclareVectorInputPort("plant_state", nq + nv).Eval
        self._wanted = self.DeclareVectorInputPort("desired_state", nq + nv).Eval
        self._acceleration = self.DeclareVectorInputPort("desired_acceleration", nv).Eval
        self.DeclareVectorOutputPort(
            "desired_force", nv, self._calc, {self.all_input_ports_ticket()}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        plant, own = self._plant, self._context
        state, wanted = self._state(context), self._wanted(context)
        nq = plant.num_positions()
        plant.SetPositionsAndVelocities(own, state)
        goal = np.array(wanted[:nq])
        for start in self._quaternions:
            part = slice(start, start + 4)
            goal[part] *= 1.0 if goal[part] @ state[part] >= 0.0 else -1.0
        way = plant.MapQDotToVelocity(own, goal - state[:nq])
        vdot = (
            self._acceleration(context)
            + self._kd * (wanted[nq:] - state[nq:])
            + self._kp * np.asarray(way)
        )
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(own, forces)
        output.set_value(plant.CalcInverseDynamics(own, vdot, forces))


def _gain(name: str, value: Array | float, nv: int) -> Array:
    gain = np.full(nv, float(value)) if np.ndim(value) == 0 else np.array(value, dtype=float)
    if gain.shape != (nv,) or not np.all(np.isfinite(gain) & (gain >= 0.0)):
        raise TensionProblemError(
            f"{name}: found {value}; accepted: one finite number >= 0, or {nv} of them"
        )
    return gain


class PlantTensionDistributor(LeafSystem):
    """Finds tensions within limits, and forces of motors, that do what a plant is asked for.

    ============= =============== ====== =========================================================
    port          type            unit   meaning
    ============= =============== ====== =========================================================
    plant_state   vector(nq + nv) m, rad in, the plant's state port
    desired_force vector(nv)      N, N m in, what cables and motors shall do together
    tensions      vector(m)       N      out, within limits
    motor_force   vector(nv)      N, N m out, what motors do, 0 on rows without, for the plant's
                                         applied_generalized_force
    feasible      vector(1)       -      out, 1 while the last request was met, else 0
    failures      vector(1)       -      out, how many requests were not met so far
    ============= =============== ====== =========================================================

    Samples its inputs at a rate of its own. A request that cannot be met, or that the method
    misses, leaves the tensions of the last one that was met; before the first they are the lower
    limits. Methods that relax answer with tensions within the limits all the same, counted as not
    met.
    """

    def __init__(
        self,
        cables: PlantCables,
        limits: tuple[Array | float, Array | float],
        method: str = "quadratic_program",
        rate: float = 1000.0,
        *,
        held: Iterable[str] | None = None,
        reference: Array | None = None,
    ) -> None:
        """For cables of a finalized plant.

        Args:
            cables: The cables, as the distributor believes them to be.
            limits: Smallest and largest tensions, shape (m,) or one for all [N].
            method: A name of `tensions.METHODS`.
            rate: Updates per second [Hz].
            held: Joints that motors hold, by name; None: those with actuators in the plant.
            reference: Wanted tensions, shape (m,) [N], for `reference_program`.

        Raises:
            TensionProblemError: Unknown method, limits that make no sense, a method that the
                redundancy excludes, or cables that cannot do at the default positions what no
                motor does: rank, too few cables.
            EquilibriumError: There is no such joint.
        """
        super().__init__()
        plant, m = cables.plant, cables.routes.count
        if not (np.isfinite(rate) and rate > 0.0):
            raise TensionProblemError(f"rate: found {rate:g}; accepted: above 0 [Hz]")
        self.rate = rate
        self._cables, self._plant, self._own = cables, plant, plant.CreateDefaultContext()
        motors = rows_of_motors(plant) if held is None else rows_of_joints(plant, held)
        self._motors, self._rows = motors, np.flatnonzero(~motors)
        problem = plant_tension_problem(
            cables, self._own, limits=limits, held=held, reference=reference
        )
        self._distribute = Distributor(problem, method)
        nq, nv = plant.num_positions(), plant.num_velocities()
        self._state = self.DeclareVectorInputPort("plant_state", nq + nv).Eval
        self._wanted = self.DeclareVectorInputPort("desired_force", nv).Eval
        self._answers = [
            int(self.DeclareDiscreteState(value))
            for value in (problem.lower, np.zeros(nv), np.zeros(1), np.zeros(1))
        ]
        self.DeclarePeriodicDiscreteUpdateEvent(1.0 / rate, 0.0, self._update)
        self.DeclareForcedDiscreteUpdateEvent(self._update)
        for name, index in zip(
            ("tensions", "motor_force", "feasible", "failures"), self._answers, strict=True
        ):
            self.DeclareStateOutputPort(name, DiscreteStateIndex(index))
        assert m == len(problem.lower)

    def _update(self, context: Context, state: DiscreteValues) -> None:
        tensions, motor, feasible, failures = map(state.get_mutable_value, self._answers)
        self._plant.SetPositionsAndVelocities(self._own, self._state(context))
        wanted = self._wanted(context)
        W = -self._cables.length_jacobian(self._own).T
        found = self._distribute(W[self._rows], -wanted[self._rows], start=tensions)
        met = found.status == TensionStatus.FEASIBLE
        feasible[0] = float(met)
        failures[0] += float(not met)
        relaxed = found.status == TensionStatus.INFEASIBLE and np.all(np.isfinite(found.tensions))
        if met or relaxed:
            tensions[:] = found.tensions
        motor[:] = np.where(self._motors, wanted - W @ tensions, 0.0)
