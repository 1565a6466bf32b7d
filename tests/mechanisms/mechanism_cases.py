"""Machines with their cables, alone and in diagrams, at rest, and at random states."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    JointIndex,
    PrismaticJoint,
    RevoluteJoint,
    ScrewJoint,
    SpatialInertia,
)
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from cdpr_drake.geometry.cable_routes import CableRoute, CableRoutes
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang, moved
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableSettings
from tests.mechanisms.machines import MACHINES, STANDING, STIFFNESS, shipped

METHODS = ("joints", "bodies")
PULLEYS = {"pulley_radius": 0.02, "anchor_pulley_radius": 0.015}


@dataclass(frozen=True, eq=False)
class Machine:
    plant: MultibodyPlant
    routes: CableRoutes

    def home(self):
        """A context of the plant alone."""
        return self.plant.CreateDefaultContext()

    def with_ends(self, **values):
        """The cables with other constants, one number for all or an array each."""
        m = self.routes.count
        arrays = {key: np.full(m, v, float) for key, v in values.items()}
        return self.routes.with_cables(replace(self.routes.ends, **arrays))


def machine(name, builder=None, time_step=0.0):
    """A machine of `MACHINES`, in a plant of its own or in one of the builder."""
    plant = MultibodyPlant(time_step)
    if builder is not None:
        plant = builder.AddNamedSystem("plant", plant)
    points = MACHINES[name](plant)
    plant.Finalize()
    cables = [CableRoute(points=p, stiffness=STIFFNESS, name=key) for key, p in points.items()]
    return Machine(plant, CableRoutes.of(plant, cables))


def advance(diagram, context, duration, step=1e-3):
    """Runge and Kutta's method of third order at a fixed step."""
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", step).set_fixed_step_mode(True)
    simulator.AdvanceTo(duration)


class Cabled:
    """A machine in a diagram with its cables and a context at home, motors idle."""

    def __init__(self, name, method="joints", *, model="kelvin_voigt", ends=None, time_step=0.0):
        builder = DiagramBuilder()
        self.machine = machine(name, builder, time_step)
        self.plant = self.machine.plant
        self.routes = self.machine.with_ends(**(ends or {}))
        settings = CableSettings(model=model, pulleys=True)
        self.ports = add_cables(builder, self.plant, self.routes, settings, method=method)
        self.cables = self.ports.cables()
        builder.ExportInput(self.ports.GetInputPort("cable_velocities"), "cable_velocities")
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        self.set_speeds(np.zeros(self.routes.count))
        self.set_motors(np.zeros(self.plant.num_velocities()))

    def set_motors(self, forces):
        """Of the joints, as `hang` gives them."""
        if self.plant.num_actuators():
            forces = self.plant.MakeActuationMatrix().T @ forces
            self.plant.get_actuation_input_port().FixValue(self.plant_context, forces)

    def set_speeds(self, speeds):
        self.diagram.GetInputPort("cable_velocities").FixValue(self.context, speeds)

    def set_state(self, q, v):
        self.plant.SetPositions(self.plant_context, q)
        self.plant.SetVelocities(self.plant_context, v)

    def set_lengths(self, l0):
        winches = self.ports.winches.GetMyMutableContextFromRoot(self.context)
        self.ports.winches.hold(winches, l0, np.zeros(len(l0)))

    def advance(self, duration, step=1e-3):
        advance(self.diagram, self.context, duration, step)

    def positions(self):
        return np.array(self.plant.GetPositions(self.plant_context))

    def accelerations(self, q, v):
        self.set_state(q, v)
        port = self.plant.get_generalized_acceleration_output_port()
        return np.array(port.Eval(self.plant_context))

    def output(self, name):
        port = self.ports.forces.GetOutputPort(name)
        context = self.diagram.GetSubsystemContext(port.get_system(), self.context)
        return np.array(port.Eval(context))


@cache
def alone(name):
    """A machine without a diagram, for all tests that leave it as it is."""
    return machine(name)


def cables_of(name, model="kelvin_voigt", **ends):
    return PlantCables(alone(name).plant, alone(name).with_ends(**ends), model)


@cache
def rest_of(name):
    """A machine at rest at home, all cables taut."""
    return hang(PlantCables(alone(name).plant, alone(name).routes), alone(name).home(),
                lower=1.0, upper=60.0)  # fmt: skip


@cache
def taut_lengths(name):
    """Unstrained lengths with which a machine stands at home; the zoo's pull with 20 N each."""
    if name in STANDING:
        return rest_of(name).unstrained_lengths
    cables = cables_of(name)
    return cables.unstrained_lengths(alone(name).home(), np.full(cables.routes.count, 20.0))


def mixed_lengths(name, taut=0.95, slack=1.1):
    """Unstrained lengths with which every third cable is slack."""
    third = np.arange(len(taut_lengths(name))) % 3 == 0
    return taut_lengths(name) * np.where(third, slack, taut)


def random_states(name, count, *, seed, spread=0.15, speed=0.5):
    """States around home: a step of up to spread in each velocity [rad, m], and velocities."""
    plant = alone(name).plant
    random, nv = np.random.default_rng(seed), plant.num_velocities()
    home = plant.GetPositions(alone(name).home())
    for _ in range(count):
        q = moved(plant, home, random.uniform(-spread, spread, nv))
        yield q, random.uniform(-speed, speed, nv)


class DrivenBases(LeafSystem):
    """Motors that make the mobile bases follow sines, and velocities that a servo is told."""

    STIFF, DAMPED, WAY, TURN = 2e5, 6e3, 0.06, 1.5
    told = 1.0

    def __init__(self, plant):
        super().__init__()
        joints = [plant.get_joint(JointIndex(i)) for i in plant.GetJointIndices()]
        self._joints = [joint for joint in joints if isinstance(joint, PrismaticJoint)]
        self._nq, self._nv = plant.num_positions(), plant.num_velocities()
        states = plant.num_multibody_states()
        self._state = self.DeclareVectorInputPort("plant_state", states)
        self.DeclareVectorOutputPort("force", self._nv, self._calc_force)
        # Measured velocities would close a loop through elastic cables.
        self.DeclareVectorOutputPort("believed_state", states, self._calc_believed)

    def _motion(self, context):
        for k, joint in enumerate(self._joints):
            turn = self.TURN * (1.0 if k % 2 else 0.8)
            phase = turn * context.get_time()
            yield joint, self.WAY * (1.0 - np.cos(phase)), turn * self.WAY * np.sin(phase)

    def _calc_force(self, context, output):
        state, force = self._state.Eval(context), np.zeros(self._nv)
        for joint, way, speed in self._motion(context):
            v = joint.velocity_start()
            off, slow = way - state[joint.position_start()], speed - state[self._nq + v]
            force[v] = self.STIFF * off + self.DAMPED * slow
        output.SetFromVector(force)

    def _calc_believed(self, context, output):
        state = np.array(self._state.Eval(context))
        for joint, _, speed in self._motion(context):
            state[self._nq + joint.velocity_start()] = self.told * speed
        output.SetFromVector(state)


def robot_with_arm():
    """A robot in blocks of its own whose platform carries a hanging arm of 1 kg."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = add_robot(plant, shipped("acrobot_fully_constrained"))
    inertia = SpatialInertia.SolidBoxWithMass(1.0, 0.02, 0.03, 0.3).Shift([0.0, 0.0, 0.15])
    arm = plant.AddRigidBody("arm", plant.AddModelInstance("arm"), inertia)
    offset = RigidTransform([0.02, 0.0, -0.05])
    F = plant.AddFrame(FixedOffsetFrame("shoulder", in_plant.body, offset))
    plant.AddJoint(RevoluteJoint("shoulder", F, arm.body_frame(), [1.0, 0.0, 0.0]))
    plant.Finalize()
    blocks = add_cable_robot(builder, in_plant)
    return plant, in_plant, blocks, builder.Build()


def screw_plant(builder):
    """A nut on a screw, a joint that is not compiled, that a cable turns."""
    plant = builder.AddSystem(MultibodyPlant(0.0))
    nut = plant.AddRigidBody("nut", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.1))
    plant.AddJoint(ScrewJoint("thread", plant.world_frame(), nut.body_frame(), [0, 0, 1], 0.05, 0))
    plant.Finalize()
    points = [(plant.world_body(), (1.0, 0.5, 0.0)), (nut, (0.1, 0.0, 0.0))]
    return plant, CableRoutes.of(plant, [CableRoute(points=points, stiffness=1e3)])
