"""Machines that follow a motion by computed torque, with tensions that are commanded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.multibody.tree import (
    BallRpyJoint,
    JointIndex,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
)
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import BasicVector, Context, DiagramBuilder, LeafSystem

from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.systems.controllers.plant_tracking import PlantTensionDistributor, PlantTracking
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.tension_driven_routes import TensionDrivenRoutes
from tests.mechanisms.machines import Machine, machine

ANGLE, WAY, PERIOD = 0.1, 0.03, 1.0
"""Amplitudes of the wanted motion [rad, m] and its period [s]."""


def wanted_motion(machine: Machine, t: float) -> tuple[Any, Any]:
    """Positions and velocities, and accelerations, from rest at home and back again.

    Each joint by (1 - cos) of its own, floating bodies about and along axes that stay.
    """
    plant, w = machine.plant, 2.0 * np.pi / PERIOD
    q = np.array(plant.GetPositions(machine.home()))
    v, a = np.zeros(plant.num_velocities()), np.zeros(plant.num_velocities())
    s = (1.0 - np.cos(w * t)) / 2.0, w * np.sin(w * t) / 2.0, w * w * np.cos(w * t) / 2.0
    for i in plant.GetJointIndices():
        joint = plant.get_joint(JointIndex(i))
        if not joint.num_velocities():
            continue
        p, k = joint.position_start(), joint.velocity_start()
        if isinstance(joint, QuaternionFloatingJoint):
            turn, way = ANGLE * np.array([0.6, 0.0, 0.8]), WAY * np.array([0.48, 0.6, 0.64])
            half = 0.5 * s[0] * np.linalg.norm(turn)
            axis = turn / np.linalg.norm(turn)
            q[p : p + 4] = _product([np.cos(half), *(np.sin(half) * axis)], q[p : p + 4])
            q[p + 4 : p + 7] += s[0] * way
            v[k : k + 6] = s[1] * np.concatenate([turn, way])
            a[k : k + 6] = s[2] * np.concatenate([turn, way])
        elif isinstance(joint, (RevoluteJoint, PrismaticJoint)):
            amplitude = ANGLE if isinstance(joint, RevoluteJoint) else WAY
            q[p] += amplitude * s[0]
            v[k], a[k] = amplitude * s[1], amplitude * s[2]
        else:
            assert isinstance(joint, BallRpyJoint)
            q[p + 2] += ANGLE * s[0]  # yaw alone turns about z of F
            v[k + 2], a[k + 2] = ANGLE * s[1], ANGLE * s[2]
    return np.concatenate([q, v]), a


def _product(a: Any, b: Any) -> Any:
    w, u = a[0], np.asarray(a[1:])
    return np.concatenate([[w * b[0] - u @ b[1:]], w * b[1:] + b[0] * u + np.cross(u, b[1:])])


class Wanted(LeafSystem):
    """`wanted_motion` on two ports."""

    def __init__(self, machine: Machine) -> None:
        super().__init__()
        states, nv = machine.plant.num_multibody_states(), machine.plant.num_velocities()

        def writer(which: int) -> Any:
            def write(context: Context, output: BasicVector) -> None:
                output.SetFromVector(wanted_motion(machine, context.get_time())[which])

            return write

        self.DeclareVectorOutputPort("desired_state", states, writer(0), {self.time_ticket()})
        self.DeclareVectorOutputPort("desired_acceleration", nv, writer(1), {self.time_ticket()})


@dataclass(frozen=True)
class Tracked:
    """What came of it: largest way off in the last half, least and largest tension, failures."""

    error: float
    tensions: tuple[float, float]
    failures: int


def track(
    name: str, limits: tuple[float, float], rate: float, *, duration: float = PERIOD,
    method: str = "quadratic_program",
) -> Tracked:  # fmt: skip
    """A machine follows `wanted_motion` on ideal tensions, updated at a rate [Hz]."""
    builder = DiagramBuilder()
    it = machine(name, builder)
    plant, cables = it.plant, PlantCables(it.plant, it.routes)
    pull = builder.AddSystem(TensionDrivenRoutes(plant, it.routes))
    goal = builder.AddSystem(Wanted(it))
    law = builder.AddSystem(PlantTracking(plant, 400.0, 40.0))
    share = builder.AddSystem(PlantTensionDistributor(cables, limits, method, rate))
    state = plant.get_state_output_port()
    for block in (pull, law, share):
        builder.Connect(state, block.GetInputPort("plant_state"))
    for port in ("desired_state", "desired_acceleration"):
        builder.Connect(goal.GetOutputPort(port), law.GetInputPort(port))
    builder.Connect(law.GetOutputPort("desired_force"), share.GetInputPort("desired_force"))
    builder.Connect(share.GetOutputPort("tensions"), pull.GetInputPort("tensions"))
    apply_force(builder, plant, pull.GetOutputPort("generalized_force"))
    apply_force(builder, plant, share.GetOutputPort("motor_force"), name="motors")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1.0 / rate)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    nq, worst, low, high = plant.num_positions(), 0.0, np.inf, 0.0
    share_context = share.GetMyContextFromRoot(context)
    steps = round(duration * 50)
    for k in range(1, steps + 1):
        simulator.AdvanceTo(k * duration / steps)
        tensions = share.GetOutputPort("tensions").Eval(share_context)
        low, high = min(low, tensions.min()), max(high, tensions.max())
        if 2 * k >= steps:
            x = wanted_motion(it, context.get_time())[0]
            off = plant.MapQDotToVelocity(plant_context, x[:nq] - plant.GetPositions(plant_context))
            worst = max(worst, float(np.max(np.abs(off))))
    failures = int(share.GetOutputPort("failures").Eval(share_context)[0])
    return Tracked(worst, (float(low), float(high)), failures)
