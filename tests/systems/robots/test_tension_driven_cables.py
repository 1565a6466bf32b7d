"""Ideal cables with commanded tensions: equilibrium, work, no pushing, what feeds through."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.errors import CableGeometryError
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.systems.robots.cable_robot import holding_tensions
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.tensions.methods import exact_tensions
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

BALANCE = 1e-9
"""Acceleration [m/s^2, rad/s^2] left at equilibrium: the round-off of tensions, 1e-15 of them."""

WORK = 1e-8
"""Work of the cables against the energy gained, relative: the error of Runge-Kutta 3 with 1 ms
on a motion of some rad/s over 0.3 s."""

DIFFERENCE = 1e-7
"""Central differences of lengths over 1e-4 s, with accelerations' rates of order ten."""


class Bench:
    """A robot at its home pose with commanded tensions."""

    def __init__(self, name, tensions, push=False, cables=None):
        self.robot = load_robot(name)
        builder = DiagramBuilder()
        self.plant = builder.AddSystem(MultibodyPlant(0.0))
        self.in_plant = add_robot(self.plant, self.robot)
        self.plant.Finalize()
        self.cables = builder.AddSystem(TensionDrivenCables(self.in_plant, push, cables))
        command = builder.AddSystem(ConstantVectorSource(tensions))
        builder.Connect(command.get_output_port(), self.cables.GetInputPort("tensions"))
        builder.Connect(
            self.plant.get_state_output_port(self.in_plant.model_instance),
            self.cables.GetInputPort("platform_state"),
        )
        builder.Connect(
            self.cables.GetOutputPort("generalized_force"),
            self.plant.get_applied_generalized_force_input_port(),
        )
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        ResetIntegratorFromFlags(self.simulator, "runge_kutta3", 1e-3)
        self.simulator.get_mutable_integrator().set_fixed_step_mode(True)
        self.context = self.simulator.get_mutable_context()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)

    def out(self, name):
        context = self.cables.GetMyContextFromRoot(self.context)
        return self.cables.GetOutputPort(name).Eval(context).copy()

    def energy(self):
        return self.plant.CalcKineticEnergy(self.plant_context) + self.plant.CalcPotentialEnergy(
            self.plant_context
        )


def home_tensions(name):
    robot = load_robot(name)
    return holding_tensions(robot, robot.home.transform(), robot.cable_set(pulleys=False))


@pytest.mark.parametrize(("name", "m", "states", "nv"), [("caroca", 8, 13, 6), ("planar", 4, 6, 3)])
def test_ports_are_these(name, m, states, nv):
    cables = Bench(name, np.zeros(m)).cables
    inputs = [cables.get_input_port(i) for i in range(cables.num_input_ports())]
    outputs = [cables.get_output_port(i) for i in range(cables.num_output_ports())]
    assert {port.get_name(): port.size() for port in inputs} == {
        "platform_state": states,
        "tensions": m,
    }
    assert {port.get_name(): port.size() for port in outputs} == {
        "generalized_force": nv,
        "lengths": m,
        "length_rates": m,
        "slack": m,
    }


def test_lengths_do_not_wait_for_tensions():
    """Otherwise a controller that reads lengths and sets tensions were an algebraic loop."""
    cables = Bench("caroca", np.zeros(8)).cables
    tensions = int(cables.GetInputPort("tensions").get_index())
    for name, waits in (
        ("generalized_force", True),
        ("lengths", False),
        ("length_rates", False),
        ("slack", True),
    ):
        index = int(cables.GetOutputPort(name).get_index())
        assert cables.HasDirectFeedthrough(tensions, index) == waits


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_holding_tensions_hold(name):
    bench = Bench(name, home_tensions(name))
    derivatives = bench.plant.EvalTimeDerivatives(bench.plant_context).CopyToVector()
    accelerations = derivatives[bench.plant.num_positions() :]
    np.testing.assert_allclose(accelerations, np.zeros_like(accelerations), atol=BALANCE)


@pytest.mark.parametrize("name", REPRESENTATIVE_ROBOTS)
def test_holding_tensions_hold_over_pulleys(name):
    robot = load_robot(name)
    cables = robot.cable_set()
    tensions = exact_tensions(tension_problem(robot, robot.home.transform(), cables=cables))
    bench = Bench(name, tensions, cables=cables)
    derivatives = bench.plant.EvalTimeDerivatives(bench.plant_context).CopyToVector()
    accelerations = derivatives[bench.plant.num_positions() :]
    np.testing.assert_allclose(accelerations, np.zeros_like(accelerations), atol=BALANCE)


@pytest.mark.parametrize("pulleys", [True, False])
@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_cables_do_the_work_that_the_platform_gains(name, pulleys):
    """Constant tensions do the work -t' (l(end) - l(start))."""
    tensions = home_tensions(name) * np.linspace(1.0, 1.3, len(load_robot(name).cables))
    bench = Bench(name, tensions, cables=load_robot(name).cable_set() if pulleys else None)
    before, lengths = bench.energy(), bench.out("lengths")
    bench.simulator.AdvanceTo(0.3)
    gained = bench.energy() - before
    work = -tensions @ (bench.out("lengths") - lengths)
    assert bench.plant.CalcKineticEnergy(bench.plant_context) > 0.0
    assert gained == pytest.approx(work, rel=WORK)


@pytest.mark.parametrize("name", ["acrobot_large", "planar"])
def test_length_rates_are_the_derivatives_of_lengths(name):
    tensions = home_tensions(name) * np.linspace(1.0, 1.3, len(load_robot(name).cables))
    bench = Bench(name, tensions)
    step, lengths = 1e-4, []
    bench.simulator.get_mutable_integrator().set_maximum_step_size(step)
    for time in (0.1 - step, 0.1, 0.1 + step):
        bench.simulator.AdvanceTo(time)
        lengths.append(bench.out("lengths"))
        if time == 0.1:
            rates = bench.out("length_rates")
    np.testing.assert_allclose(rates, (lengths[2] - lengths[0]) / (2.0 * step), atol=DIFFERENCE)


def test_a_cable_does_not_push():
    tensions = home_tensions("caroca")
    tensions[2], tensions[5] = -50.0, 0.0
    pushed = Bench("caroca", tensions)
    slack = Bench("caroca", np.maximum(tensions, 0.0))
    np.testing.assert_array_equal(pushed.out("generalized_force"), slack.out("generalized_force"))
    np.testing.assert_array_equal(pushed.out("slack"), [0, 0, 1, 0, 0, 1, 0, 0])


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_rods_push(name):
    """The same force with both signs is nothing, where cables would give that of half of them."""
    tensions = home_tensions(name)
    pulled, pushed = (Bench(name, sign * tensions, push=True) for sign in (1.0, -1.0))
    force = pulled.out("generalized_force")
    np.testing.assert_array_equal(pushed.out("generalized_force"), -force)
    np.testing.assert_array_equal(force, Bench(name, tensions).out("generalized_force"))
    np.testing.assert_array_equal(pushed.out("slack"), np.ones(len(tensions)))


def test_an_anchor_point_in_a_groove_is_refused():
    robot = load_robot("caroca")
    cables = robot.cable_set()
    bench = Bench("caroca", home_tensions("caroca"), cables=cables)
    touching = cables.p_WA[:, 0] - cables.p_PB[:, 0]
    bench.in_plant.set_pose(bench.plant_context, RigidTransform(touching))
    with pytest.raises(
        CableGeometryError, match=r"at 0 s: cable 1: its anchor point .* swivel axis"
    ):
        bench.out("generalized_force")


def test_without_tensions_the_platform_falls():
    bench = Bench("caroca", np.full(8, -1.0))
    bench.simulator.AdvanceTo(0.1)
    velocity = bench.plant.GetVelocities(bench.plant_context)
    np.testing.assert_allclose(velocity, [0.0, 0.0, 0.0, 0.0, 0.0, -0.981], atol=BALANCE)
