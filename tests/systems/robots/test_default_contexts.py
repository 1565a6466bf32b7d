"""Default and random contexts: every one begins at rest."""

import numpy as np
import pytest
from pydrake.common import RandomGenerator
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import MonteCarloSimulation, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.errors import CableModelError, CdprError, InfeasibleTensionError
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_copies import moved_robot
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.random_pose import RandomPose
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, WinchSettings

AT_REST = 1e-7
"""How far a platform at rest moves in a tenth of a second [m], by an integrator of accuracy 1e-4;
one whose cables are just not taut moves by 1e-5 and more."""

ENGINES = (CableRobot, CompiledCableRobot)


def fix_inputs(block, context):
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        if port.get_name() in ("brakes", "cable_velocities"):
            port.FixValue(context, np.zeros(port.size()))


def moves(block, context, duration=0.1):
    """How far the platform is from where it begins, after the initialization, at the end [m]."""
    fix_inputs(block, context)
    simulator = Simulator(block, context)
    simulator.Initialize()
    start = block.GetOutputPort("X_WP").Eval(context).translation().copy()
    simulator.AdvanceTo(context.get_time() + duration)
    return np.max(np.abs(block.GetOutputPort("X_WP").Eval(context).translation() - start)), start


def creeping():
    robot = load_robot("acrobot_small")
    robot.cable.behaviour = BehaviourSettings(creep_stiffness=2.0)
    return robot


CASES = {
    "acrobot_small": (lambda: load_robot("acrobot_small"), CableRobotSettings()),
    "sagging": (
        lambda: load_robot("caroca"),
        CableRobotSettings(cables=CableSettings(model="catenary", pulleys=True)),
    ),
    "planar": (lambda: load_robot("planar"), CableRobotSettings()),
    "point on a plane": (lambda: load_robot("maslow_4"), CableRobotSettings()),
    "too few cables": (lambda: load_robot("grab_three"), CableRobotSettings()),
    "creeping": (creeping, CableRobotSettings()),
    "motors": (
        lambda: load_robot("acrobot_large"),
        CableRobotSettings(winches=WinchSettings(kind="motor")),
    ),
}


@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize("case", CASES)
def test_default_and_random_contexts_begin_at_rest(case, kind):
    make, settings = CASES[case]
    block = kind(make(), settings)
    assert block.not_at_rest == ""
    context = block.CreateDefaultContext()
    assert moves(block, context)[0] < AT_REST
    for reset in (block.SetDefaultContext, lambda c: block.SetRandomContext(c, RandomGenerator(1))):
        context.SetTime(0.0)
        reset(context)
        assert moves(block, context)[0] < AT_REST
        fix_inputs(block, context)
        assert np.min(block.GetOutputPort("tensions").Eval(context)) > 0.0


@pytest.mark.parametrize("kind", ENGINES)
def test_a_simulator_that_is_reset_begins_at_rest(kind):
    block = kind(load_robot("acrobot_small"))
    simulator = Simulator(block)
    simulator.reset_context(block.CreateDefaultContext())
    assert moves(block, simulator.get_mutable_context())[0] < AT_REST


@pytest.mark.parametrize("kind", ENGINES)
def test_why_a_home_that_nothing_holds_is_no_rest(kind):
    robot = load_robot("acrobot_small")
    robot.tension_bounds.lower = 55.0
    block = kind(robot)
    assert "cannot hold the platform" in block.not_at_rest
    context = block.CreateDefaultContext()
    fix_inputs(block, context)
    assert np.max(block.GetOutputPort("tensions").Eval(context)) < 1e-6


SPREAD = RandomPose(position=[0.03, 0.02, 0.04], angles_deg=[3.0, 3.0, 3.0])


def two_in_a_plant(step, random_pose=None):
    """Two robots in one plant, one of them with another default pose."""
    builder = DiagramBuilder()
    plant, scene_graph = builder.AddSystem(MultibodyPlant(step)), builder.AddSystem(SceneGraph())
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    small = load_robot("acrobot_small")
    other = moved_robot(load_robot("acrobot_large"), [3.0, 0.0, 0.0])
    parts = [add_robot(plant, robot, name) for robot, name in ((small, "one"), (other, "two"))]
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(parts[0].body, RigidTransform([0.05, -0.03, 0.2]))
    blocks = []
    for part, name in zip(parts, ("one", "two"), strict=True):
        blocks.append(add_cable_robot(builder, part, name=name, random_pose=random_pose))
        still = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
        builder.Connect(still.get_output_port(), blocks[-1].GetInputPort("cable_velocities"))
    return builder.Build(), plant, parts, blocks


@pytest.mark.parametrize("step", [0.0, 5e-4])
@pytest.mark.parametrize("spread", [None, SPREAD])
def test_two_robots_in_one_plant_begin_at_rest_where_the_plant_puts_them(step, spread):
    diagram, plant, parts, _ = two_in_a_plant(step, spread)
    places = []
    for seed in (None, 1, 2):
        context = diagram.CreateDefaultContext()
        if seed is not None:
            diagram.SetRandomContext(context, RandomGenerator(seed))
        own = plant.GetMyContextFromRoot(context)
        start = [part.pose(own).translation().copy() for part in parts]
        Simulator(diagram, context).AdvanceTo(0.05)
        end = [part.pose(own).translation() for part in parts]
        assert np.max(np.abs(np.subtract(end, start))) < AT_REST
        places.append(start[0])
    np.testing.assert_allclose(places[0], [0.05, -0.03, 0.2], atol=1e-12)
    if spread is None:
        np.testing.assert_allclose(places, places[:1] * 3, atol=1e-12)
    else:
        assert np.max(np.abs(places[1] - places[2])) > 1e-3
        assert np.all(np.abs(np.subtract(places, places[0])) <= [0.03, 0.02, 0.04])


@pytest.mark.parametrize("kind", ENGINES)
@pytest.mark.parametrize(
    ("name", "winches"),
    [
        ("acrobot_small", WinchSettings()),
        ("acrobot_large", WinchSettings(kind="motor")),
        ("planar", WinchSettings()),
        ("maslow_4", WinchSettings()),
    ],
)
def test_monte_carlo_simulations_begin_at_rest_at_drawn_poses(name, winches, kind):
    robot = load_robot(name)
    spread = RandomPose(position=[0.04, 0.03, 0.0], angles_deg=[0.0, 0.0, 4.0])
    block = kind(robot, CableRobotSettings(winches=winches), random_pose=spread)

    def make_simulator(generator):
        simulator = Simulator(block)
        fix_inputs(block, simulator.get_mutable_context())
        return simulator

    starts, found = [], []

    def output(system, context):
        found.append(pose_row(block.GetOutputPort("X_WP").Eval(context)))
        return 0.0

    for final_time in (0.0, 0.05):
        MonteCarloSimulation(
            make_simulator=make_simulator, output=output, final_time=final_time, num_samples=3,
            generator=RandomGenerator(4),
        )  # fmt: skip
        starts.append(np.array(found))
        found.clear()
    np.testing.assert_allclose(starts[1], starts[0], atol=AT_REST)
    assert np.max(np.ptp(starts[0], axis=0)) > 5e-3


def test_both_engines_draw_the_same_kind_of_poses():
    robot, spread = load_robot("acrobot_small"), RandomPose(position=[0.1, 0.0, 0.0])
    places = []
    for kind in ENGINES:
        block = kind(robot, random_pose=spread)
        context, generator = block.CreateDefaultContext(), RandomGenerator(3)
        for _ in range(40):
            context.SetTime(0.0)
            block.SetRandomContext(context, generator)
            fix_inputs(block, context)
            Simulator(block, context).Initialize()
            places.append(block.GetOutputPort("X_WP").Eval(context).translation().copy())
    for each in np.split(np.array(places), 2):
        assert np.all(np.abs(each[:, 0]) <= 0.1)
        assert np.std(each[:, 0]) == pytest.approx(0.1 / np.sqrt(3.0), rel=0.25)
        np.testing.assert_allclose(each[:, 1:], np.tile([0.0, 0.15], (40, 1)), atol=1e-12)


@pytest.mark.parametrize("kind", ENGINES)
def test_lengths_that_somebody_sets_stay(kind):
    block = kind(load_robot("acrobot_small"), random_pose=RandomPose(position=[0.05] * 3))
    context = block.CreateDefaultContext()
    block.SetRandomContext(context, RandomGenerator(1))
    X_WP = RigidTransform([0.02, 0.01, 0.2])
    block.set_at_equilibrium(context, X_WP)
    assert moves(block, context)[0] < AT_REST
    np.testing.assert_allclose(
        block.GetOutputPort("X_WP").Eval(context).translation(), X_WP.translation(), atol=AT_REST
    )


def test_random_poses_that_make_no_sense_are_refused_by_name():
    with pytest.raises(CdprError, match=r"RandomPose\.position: found \[-1, 0, 0\]"):
        RandomPose(position=[-1, 0, 0])
    with pytest.raises(CableModelError, match="random_pose of grab_three"):
        CableRobot(load_robot("grab_three"), random_pose=RandomPose())
    block = CableRobot(load_robot("acrobot_small"), random_pose=RandomPose(position=[3.0, 3.0, 0]))
    context = block.CreateDefaultContext()
    block.SetRandomContext(context, RandomGenerator(1))
    fix_inputs(block, context)
    with pytest.raises((InfeasibleTensionError, CdprError)):
        Simulator(block, context).Initialize()
