"""A plant's wanted motion as a block, winches that wind along it, and motors that follow it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.arrays import Array
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import Rest, rows_of_motors
from cdpr_drake.trajectories.plant_motion import PlantMotion

INSTANT = 1e-9
"""A time so close below a control step counts as that step, of its period."""


class WantedPlantMotion(LeafSystem):
    """A plant's wanted motion over time, for `PlantTracking`.

    ==================== =============== ============= =========================================
    port                 type            unit          meaning
    ==================== =============== ============= =========================================
    desired_state        vector(nq + nv) m, rad        out, positions and velocities
    desired_acceleration vector(nv)      m/s^2,rad/s^2 out
    ==================== =============== ============= =========================================
    """

    def __init__(self, plant: MultibodyPlant, motion: PlantMotion) -> None:
        """Of a finalized plant."""
        super().__init__()
        self._motion = motion
        states, nv = plant.num_multibody_states(), plant.num_velocities()
        time = {self.time_ticket()}
        self.DeclareVectorOutputPort("desired_state", states, self._calc_state, time)
        self.DeclareVectorOutputPort("desired_acceleration", nv, self._calc_acceleration, time)

    def _calc_state(self, context: Context, output: BasicVector) -> None:
        q, v, _ = self._motion.at(context.get_time())
        output.set_value(np.concatenate([q, v]))

    def _calc_acceleration(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._motion.at(context.get_time())[2])


class LengthFollower(LeafSystem):
    """Commands winches to the lengths of the cables along a wanted motion.

    ================ ========= ==== ===========================================================
    port             type      unit meaning
    ================ ========= ==== ===========================================================
    cable_velocities vector(m) m/s  out, positive pays out; the same within a control step
    ================ ========= ==== ===========================================================

    Unstrained lengths are l(q_d) l0 / l of the start: every cable keeps the strain that it starts
    with, l0 = l(q_d) / (1 + t0 / (E S)) of an elastic one. The velocity is what takes them to those
    of the next control step, so that winches are where they should be at every step.
    """

    def __init__(self, cables: PlantCables, motion: PlantMotion, start: Rest, rate: float) -> None:
        """For winches that start at a rest, commanded at a rate [Hz]."""
        super().__init__()
        self._cables, self._own = cables, cables.plant.CreateDefaultContext()
        self._motion, self._period = motion, 1.0 / rate
        self._share = start.unstrained_lengths / self._lengths(0.0)
        m = cables.routes.count
        self._step, self._velocities = -1, np.zeros(m)
        self.DeclareVectorOutputPort("cable_velocities", m, self._calc, {self.time_ticket()})

    def lengths(self, time: float) -> Array:
        """Unstrained lengths that winches shall have at a time [s], shape (m,) [m]."""
        return np.asarray(self._share * self._lengths(time))

    def _lengths(self, time: float) -> Array:
        self._cables.plant.SetPositions(self._own, self._motion.at(time)[0])
        return self._cables.lengths_and_jacobian(self._own)[0]

    def _calc(self, context: Context, output: BasicVector) -> None:
        step = int(np.floor(context.get_time() / self._period + INSTANT))
        if step != self._step:
            before, after = (self.lengths(k * self._period) for k in (step, step + 1))
            self._step, self._velocities = step, (after - before) / self._period
        output.set_value(self._velocities)


class MotorFollower(LeafSystem):
    """Forces of the motors of joints that follow a wanted motion against cables.

    ============= =============== ====== =========================================================
    port          type            unit   meaning
    ============= =============== ====== =========================================================
    desired_state vector(nq + nv) m, rad in, the wanted motion
    desired_force vector(nv)      N, N m in, of `PlantTracking`: inertia and gravity, and feedback
    motor_force   vector(nv)      N, N m out, on rows with motors, else 0
    ============= =============== ====== =========================================================

    Feed-forward takes cables at the wanted positions to have the tensions of the start.
    """

    def __init__(self, cables: PlantCables, tensions: Array) -> None:
        """For cables of a finalized plant, of tensions, shape (m,) [N]."""
        super().__init__()
        plant = cables.plant
        self._cables, self._own = cables, plant.CreateDefaultContext()
        self._tensions, self._motors = tensions, rows_of_motors(plant)
        self._nq, nv = plant.num_positions(), plant.num_velocities()
        self._wanted: Callable[[Context], Array] = self.DeclareVectorInputPort(
            "desired_state", plant.num_multibody_states()
        ).Eval
        self._force: Callable[[Context], Array] = self.DeclareVectorInputPort(
            "desired_force", nv
        ).Eval
        self.DeclareVectorOutputPort("motor_force", nv, self._calc, {self.all_input_ports_ticket()})

    def _calc(self, context: Context, output: BasicVector) -> None:
        self._cables.plant.SetPositions(self._own, self._wanted(context)[: self._nq])
        against = self._cables.length_jacobian(self._own).T @ self._tensions
        output.set_value(np.where(self._motors, self._force(context) + against, 0.0))
