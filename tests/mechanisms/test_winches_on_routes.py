"""Winches with motors, sensors, breaking loads and tension correction on cables between bodies."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.errors import InfeasibleTensionError
from cdpr_drake.models.plant_cables import PlantCables
from cdpr_drake.models.plant_rest import hang
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.controllers.correction_laws import ConstantThreshold
from cdpr_drake.systems.controllers.tension_corrector import TensionCorrector
from cdpr_drake.systems.monitoring.tension_watch import BreakingLoadWatch
from cdpr_drake.systems.robots.assembly import apply_force
from cdpr_drake.systems.robots.motor_winch import MotorWinch
from cdpr_drake.systems.robots.route_assembly import add_cables
from tests.mechanisms.driven_bases import DrivenBases
from tests.mechanisms.machines import machine

SLACKENED = 0.01
"""By how much a cable is paid out [m]: more than it is stretched by."""


def masts_on_winches(winches, **ends):
    """The machine with eyelets on its masts, held bases, its cables on such winches, at rest."""
    builder = DiagramBuilder()
    it = machine("mobile_masts", builder)
    routes = it.with_ends(stiffness=2e4, retardation=0.02, **ends)
    home, _ = PlantCables(it.plant, routes).lengths_and_jacobian(it.home())
    blocks = add_cables(builder, it.plant, routes, winches=winches(home))
    rest = hang(PlantCables(it.plant, routes), it.home(), prestress=20.0, lower=5.0)
    motors = builder.AddSystem(ConstantVectorSource(rest.held))
    apply_force(builder, it.plant, motors.get_output_port(), name="motors")
    bases = builder.AddSystem(DrivenBases(it.plant))
    bases.WAY = 0.0
    builder.Connect(it.plant.get_state_output_port(), bases.GetInputPort("plant_state"))
    apply_force(builder, it.plant, bases.GetOutputPort("force"), name="bases")
    return builder, it, blocks, rest


def advanced(diagram, context, duration):
    simulator = Simulator(diagram, context)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 2.5e-4)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.AdvanceTo(duration)
    return simulator.get_context()


STAYS = 1e-8
"""By how much a machine at rest on motors may move in a while [m, rad]: motors start from torques
that are computed from the tensions, to rounding, and nothing damps them but friction."""


def test_motors_hold_a_machine_that_hangs():
    law = load_robot("acrobot_small").winch_law()
    builder, it, blocks, rest = masts_on_winches(lambda home: MotorWinch(law, "velocity", home))
    zero = builder.AddSystem(ConstantVectorSource(np.zeros(it.routes.count)))
    builder.Connect(zero.get_output_port(), blocks.GetInputPort("cable_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    blocks.put(context, rest)
    if blocks.HasInputPort("brakes"):
        winches = blocks.winches.GetMyMutableContextFromRoot(context)
        blocks.GetInputPort("brakes").FixValue(winches, np.zeros(it.routes.count))
    before = it.plant.GetPositions(it.plant.GetMyContextFromRoot(context)).copy()
    context = advanced(diagram, context, 0.1)
    after = it.plant.GetPositions(it.plant.GetMyContextFromRoot(context))
    np.testing.assert_allclose(after, before, rtol=0, atol=STAYS)


def test_tension_correction_takes_up_slack_of_a_cable_over_eyelets():
    builder, it, blocks, rest = masts_on_winches(lambda home: None)
    m = it.routes.count
    threshold, gain = np.full(m, 10.0), np.full(m, 2e-3)
    corrector = builder.AddSystem(TensionCorrector(ConstantThreshold(threshold, gain), m, 200.0))
    builder.Connect(blocks.GetOutputPort("tensions"), corrector.GetInputPort("tensions"))
    builder.Connect(blocks.GetOutputPort("unstrained_lengths"), corrector.GetInputPort("lengths"))
    builder.Connect(
        corrector.GetOutputPort("cable_velocities"), blocks.GetInputPort("cable_velocities")
    )
    zero = builder.AddSystem(ConstantVectorSource(np.zeros(m)))
    builder.Connect(zero.get_output_port(), corrector.GetInputPort("commanded_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    blocks.put(context, rest)
    winches = blocks.winches.GetMyMutableContextFromRoot(context)
    slackened = rest.unstrained_lengths + SLACKENED * np.eye(m)[0]
    blocks.winches.set_unstrained_lengths(winches, slackened)
    forces = blocks.forces.GetMyContextFromRoot(context)
    assert blocks.GetOutputPort("slack").Eval(forces)[0] == 1.0
    context = advanced(diagram, context, 1.0)
    tensions = blocks.GetOutputPort("tensions").Eval(blocks.forces.GetMyContextFromRoot(context))
    assert tensions[0] > 0.5 * threshold[0]


def test_a_breaking_load_bounds_hanging_and_is_watched():
    loads = np.full(8, np.inf)
    loads[2] = 42.0
    builder, it, blocks, rest = masts_on_winches(lambda home: None, breaking_load=loads)
    assert rest.tensions[2] > 33.0
    weaker = np.where(loads < np.inf, 33.0, loads)
    cables = PlantCables(it.plant, it.with_ends(breaking_load=weaker))
    assert hang(cables, it.home(), prestress=20.0, lower=5.0).tensions[2] <= 33.0
    watch = builder.AddSystem(BreakingLoadWatch(loads, stop=True))
    builder.Connect(blocks.GetOutputPort("tensions"), watch.GetInputPort("tensions"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    blocks.put(context, rest)
    pull = np.zeros(it.routes.count)
    pull[2] = -0.05
    blocks.GetInputPort("cable_velocities").FixValue(
        blocks.winches.GetMyMutableContextFromRoot(context), pull
    )
    context = advanced(diagram, context, 0.2)
    broken = watch.broken(watch.GetMyContextFromRoot(context))
    assert 0.0 < broken[2] <= context.get_time() < 0.2
    assert np.all(np.delete(broken, 2) == -1.0)
    weak = PlantCables(it.plant, it.with_ends(breaking_load=0.01))
    with pytest.raises(InfeasibleTensionError, match=r"0\.01 N"):
        hang(weak, it.home(), lower=0.0)
