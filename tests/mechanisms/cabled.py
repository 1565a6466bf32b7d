"""Machines in diagrams with their cables, and states of them, which the tests here share."""

from __future__ import annotations

from functools import cache

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang, moved
from cdpr_drake.systems.robots.route_assembly import add_cables
from cdpr_drake.systems.robots.settings import CableSettings
from tests.mechanisms.machines import STANDING, machine

METHODS = ("joints", "bodies")
LEAST, MOST = 1.0, 60.0
"""Tensions with which machines hang [N]."""


class Cabled:
    """A machine in a diagram with its cables and a context at home, motors idle."""

    def __init__(self, name, method="joints", *, model="kelvin_voigt", ends=None, time_step=0.0):
        builder = DiagramBuilder()
        self.machine = machine(name, builder, time_step)
        self.plant = self.machine.plant
        routes = self.machine.routes if ends is None else self.machine.with_ends(**ends)
        settings = CableSettings(model=model, pulleys=True)
        self.ports = add_cables(builder, self.plant, routes, settings, method=method)
        self.cables = self.ports.cables()
        builder.ExportInput(self.ports.GetInputPort("cable_velocities"), "cable_velocities")
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)
        self.home = np.array(self.plant.GetPositions(self.plant_context))
        m = routes.count
        self.diagram.GetInputPort("cable_velocities").FixValue(self.context, np.zeros(m))
        if self.plant.num_actuators():
            self.set_motors(np.zeros(self.plant.num_actuators()))

    def set_motors(self, forces):
        self.plant.get_actuation_input_port().FixValue(self.plant_context, forces)

    def set_state(self, q, v):
        self.plant.SetPositions(self.plant_context, q)
        self.plant.SetVelocities(self.plant_context, v)

    def set_lengths(self, l0):
        winches = self.ports.winches.GetMyMutableContextFromRoot(self.context)
        self.ports.winches.hold(winches, l0, np.zeros(len(l0)))

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


@cache
def cables_of(name):
    """The cables of `alone`, straight and undamped."""
    return PlantCables(alone(name).plant, alone(name).routes)


@cache
def rest_of(name):
    """A machine at rest at home, all cables taut; the zoo's lengths at home, shortened."""
    if name in STANDING:
        return hang(cables_of(name), alone(name).home(), lower=LEAST, upper=MOST)
    raise KeyError(name)


@cache
def taut_lengths(name):
    """Unstrained lengths with which a machine stands at home; the zoo's pull with 20 N each."""
    if name in STANDING:
        return rest_of(name).unstrained_lengths
    cables = cables_of(name)
    return cables.unstrained_lengths(alone(name).home(), np.full(cables.routes.count, 20.0))


def random_states(name, count, *, seed, spread=0.15, speed=0.5):
    """States around home: a step of up to spread in each velocity [rad, m], and velocities."""
    plant = alone(name).plant
    random, nv = np.random.default_rng(seed), plant.num_velocities()
    home = plant.GetPositions(alone(name).home())
    for _ in range(count):
        q = moved(plant, home, random.uniform(-spread, spread, nv))
        yield q, random.uniform(-speed, speed, nv)
