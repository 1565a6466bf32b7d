"""Contexts begin at rest, and episodes where the first did; names, forces, templates of blocks."""

import inspect
from functools import cache

import gymnasium
import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.common import RandomGenerator
from pydrake.geometry import SceneGraph
from pydrake.gym import DrakeGymEnv
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem_
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.models.robot_copies import moved_robot
from cdpr_drake.models.robot_in_plant import add_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import RobotBlock, add_cable_robot, apply_force
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.random_pose import RandomPose
from cdpr_drake.systems.robots.templates import class_for_floats
from tests.systems.robots.engines import (
    BY_ENGINE,
    behaving,
    fix_commands,
    integrate,
    made,
    place,
    read,
    settings_of,
)
from tests.systems.robots.test_refusals import NAMED_BLOCKS, in_own_plant

AT_REST = 1e-7
"""How far a platform at rest moves [m], by an integrator of accuracy 1e-4; one whose cables are
just not taut moves by 1e-5 and more."""

SPREAD = RandomPose(position=[0.03, 0.02, 0.04], angles_deg=[3.0, 3.0, 3.0])
LEVEL = RandomPose(position=[0.04, 0.03, 0.0], angles_deg=[0.0, 0.0, 4.0])
X_WP = RigidTransform([0.02, 0.01, 0.2])


CASES = {
    "small": ("acrobot_small", settings_of()),
    "sagging": ("caroca", settings_of(model="catenary", pulleys=True)),
    "planar": ("planar", settings_of()),
    "point on a plane": ("maslow_4", settings_of()),
    "too few cables": ("grab_three", settings_of()),
    "creeping": (behaving(load_robot("acrobot_small"), creep_stiffness=2.0), settings_of()),
    "stiffening": (
        behaving(load_robot("acrobot_large"), stiffening=2e-3, expansion=1.2e-5, warmer=15.0),
        settings_of(),
    ),
    "motors": ("acrobot_large", settings_of("velocity")),
}


def moves(block, context, duration=0.05):
    """How far the platform is from where it begins, after the initialization, at the end [m]."""
    fix_commands(block, context)
    simulator = Simulator(block, context)
    simulator.Initialize()
    start = place(block, context)
    simulator.AdvanceTo(context.get_time() + duration)
    return np.max(np.abs(place(block, context) - start))


@BY_ENGINE
@pytest.mark.parametrize("case", CASES)
def test_default_and_random_contexts_begin_at_rest(case, kind):
    block = kind(*CASES[case])
    assert block.not_at_rest == ""
    context = block.CreateDefaultContext()
    assert moves(block, context) < AT_REST
    for reset in (block.SetDefaultContext, lambda c: block.SetRandomContext(c, RandomGenerator(1))):
        context.SetTime(0.0)
        reset(context)
        assert moves(block, context) < AT_REST
        fix_commands(block, context)
        assert np.min(read(block, context, "tensions")) > 0.0
    simulator = Simulator(block)
    simulator.reset_context(block.CreateDefaultContext())
    assert moves(block, simulator.get_mutable_context(), 0.02) < AT_REST


@BY_ENGINE
def test_why_a_home_that_nothing_holds_is_no_rest(kind):
    robot = load_robot("acrobot_small")
    robot.tension_bounds.lower = 55.0
    block = kind(robot)
    assert "cannot hold the platform" in block.not_at_rest
    context = block.CreateDefaultContext()
    fix_commands(block, context)
    assert np.max(read(block, context, "tensions")) < 1e-6


def two_in_a_plant(step, random_pose=None):
    """Two robots in one plant, one of them with another default pose."""
    builder = DiagramBuilder()
    plant, scene_graph = builder.AddSystem(MultibodyPlant(step)), builder.AddSystem(SceneGraph())
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    other = moved_robot(load_robot("acrobot_large"), [3.0, 0.0, 0.0])
    robots = {"one": load_robot("acrobot_small"), "two": other}
    parts = [add_robot(plant, robot, name) for name, robot in robots.items()]
    plant.Finalize()
    plant.SetDefaultFloatingBaseBodyPose(parts[0].body, RigidTransform([0.05, -0.03, 0.2]))
    for part, name in zip(parts, robots, strict=True):
        block = add_cable_robot(builder, part, name=name, random_pose=random_pose)
        still = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
        builder.Connect(still.get_output_port(), block.GetInputPort("cable_velocities"))
    return builder.Build(), plant, parts


@pytest.mark.parametrize("step", [0.0, 5e-4])
@pytest.mark.parametrize("spread", [None, SPREAD])
def test_two_robots_in_one_plant_begin_at_rest_where_the_plant_puts_them(step, spread):
    diagram, plant, parts = two_in_a_plant(step, spread)
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


@BY_ENGINE
@pytest.mark.parametrize("case", ["small", "motors", "planar", "point on a plane"])
def test_drawn_poses_differ_and_are_at_rest(case, kind):
    block = kind(*CASES[case], random_pose=LEVEL)
    context, generator, places = block.CreateDefaultContext(), RandomGenerator(4), []
    for _ in range(3):
        context.SetTime(0.0)
        block.SetRandomContext(context, generator)
        assert moves(block, context) < AT_REST
        places.append(place(block, context))
    assert np.max(np.ptp(places, axis=0)) > 5e-3


@BY_ENGINE
def test_poses_are_drawn_evenly(kind):
    block = kind(load_robot("acrobot_small"), random_pose=RandomPose(position=[0.1, 0.0, 0.0]))
    context, generator, places = block.CreateDefaultContext(), RandomGenerator(3), []
    for _ in range(40):
        context.SetTime(0.0)
        block.SetRandomContext(context, generator)
        fix_commands(block, context)
        Simulator(block, context).Initialize()
        places.append(place(block, context))
    places = np.array(places)
    assert np.all(np.abs(places[:, 0]) <= 0.1)
    assert np.std(places[:, 0]) == pytest.approx(0.1 / np.sqrt(3.0), rel=0.25)
    np.testing.assert_allclose(places[:, 1:], np.tile([0.0, 0.15], (40, 1)), atol=1e-12)


@BY_ENGINE
def test_lengths_that_somebody_sets_stay(kind):
    block = kind(load_robot("acrobot_small"), random_pose=RandomPose(position=[0.05] * 3))
    context = block.CreateDefaultContext()
    block.SetRandomContext(context, RandomGenerator(1))
    block.set_at_equilibrium(context, X_WP)
    assert moves(block, context) < AT_REST
    np.testing.assert_allclose(place(block, context), X_WP.translation(), atol=AT_REST)


@BY_ENGINE
def test_an_equilibrium_is_set_from_the_root_or_from_the_blocks_own_context(kind):
    builder = DiagramBuilder()
    block = builder.AddSystem(kind("acrobot_small"))
    builder.ExportInput(block.GetInputPort("cable_velocities"), "v")
    diagram, tensions = builder.Build(), []
    for own in (False, True):
        root = diagram.CreateDefaultContext()
        diagram.GetInputPort("v").FixValue(root, np.zeros(8))
        mine = block.GetMyMutableContextFromRoot(root)
        block.set_at_equilibrium(mine if own else root, X_WP)
        tensions.append(read(block, mine, "tensions"))
        assert block.GetOutputPort("X_WP").Eval(mine).IsNearlyEqualTo(X_WP, 1e-12)
    np.testing.assert_array_equal(tensions[0], tensions[1])
    assert np.min(tensions[0]) > 0.0


@cache
def environment(kind, reset_handler=True):
    """For learning; by fixed steps, since one that chooses them remembers the last one."""
    robot = load_robot("acrobot_small")
    block = made(kind, robot)
    simulator = Simulator(block)
    integrate(block, simulator, 1e-3)

    def hang(_simulator, context, _seed):
        block.set_at_equilibrium(context, robot.home.transform())

    return DrakeGymEnv(
        simulator=simulator,
        time_step=0.05,
        action_space=gymnasium.spaces.Box(-0.1, 0.1, (8,)),
        observation_space=gymnasium.spaces.Box(-np.inf, np.inf, (13,)),
        reward=lambda system, context: system.GetOutputPort("X_WP").Eval(context).translation()[2],
        action_port_id="cable_velocities",
        observation_port_id="platform_state",
        reset_handler=hang if reset_handler else None,
    )


def episode(env):
    states = [env.reset(seed=3)[0]]
    total = 0.0
    for k in range(3):
        state, reward, terminated, truncated, _ = env.step(0.02 * np.sin(np.arange(8.0) + k))
        assert not terminated
        assert not truncated
        states.append(state)
        total += reward
    return np.array(states), total


@pytest.mark.parametrize("reset_handler", [True, False], ids=["hung", "default"])
@BY_ENGINE
def test_every_episode_begins_where_the_first_did(kind, reset_handler):
    env = environment(kind, reset_handler)
    first, total = episode(env)
    assert np.linalg.norm(first[-1] - first[0]) > 1e-3  # it moved
    for _ in range(2):
        again, also = episode(env)
        assert again.tobytes() == first.tobytes()
        assert also == total


@BY_ENGINE
def test_episodes_of_one_step_follow_their_own_action(kind):
    """The compiled robot remembers what it reached; that is not another episode's."""
    env, reached = environment(kind), []
    for speed in (0.02, -0.02, 0.02):
        env.reset(seed=3)
        reached.append(env.step(np.full(8, speed))[0])
    assert np.linalg.norm(reached[1] - reached[0]) > 1e-3
    assert reached[2].tobytes() == reached[0].tobytes()


def test_a_robot_stays_where_it_is_when_the_time_is_set_back():
    """As the plant does: its state does not know the time."""
    block = CompiledCableRobot("acrobot_small")
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.GetInputPort("cable_velocities").FixValue(context, np.full(8, 0.01))
    simulator.AdvanceTo(0.05)
    simulator.AdvancePendingEvents()
    before = read(block, context, "platform_state")
    context.SetTime(0.0)
    with pytest.raises(
        RuntimeError, match=r"state is that of 0\.05 s.* stands at 0 s.*set the time first"
    ):
        read(block, context, "platform_state")
    simulator.Initialize()
    assert read(block, context, "platform_state").tobytes() == before.tobytes()
    assert not read(block, context, "steps").any()
    simulator.AdvanceTo(0.05)
    assert read(block, context, "platform_state")[6] < before[6]


# Blocks take names and add forces up.

NAME = "acrobot_small"
ROBOT = load_robot(NAME)


@pytest.mark.parametrize("what", NAMED_BLOCKS)
def test_blocks_take_a_name_in_place_of_a_robot(what):
    NAMED_BLOCKS[what](NAME)


def test_robot_blocks_are_told_by_their_protocol():
    for block in (CableRobot(NAME), CompiledCableRobot(NAME), add_cable_robot(*in_own_plant())):
        assert isinstance(block, RobotBlock)
    assert not isinstance(MultibodyPlant(0.0), RobotBlock)


@pytest.mark.parametrize("after", [False, True])
def test_own_generalized_forces_add_up_before_and_after(after):
    """Half of the weight is carried, so that the platform rises with the tensions of all of it."""
    builder, in_plant = in_own_plant()
    plant, lift = in_plant.plant, np.zeros(6)
    lift[5] = 0.5 * ROBOT.platform.mass * ROBOT.gravity
    force = builder.AddSystem(ConstantVectorSource(lift))
    if not after:
        port = plant.get_applied_generalized_force_input_port()
        builder.Connect(force.get_output_port(), port)
    block = add_cable_robot(builder, in_plant)
    if after:
        apply_force(builder, plant, force.get_output_port(), name="lift")
    still = builder.AddSystem(ConstantVectorSource(np.zeros(8)))
    builder.Connect(still.get_output_port(), block.GetInputPort("cable_velocities"))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyContextFromRoot(context)
    acceleration = plant.get_generalized_acceleration_output_port().Eval(own)
    assert acceleration[5] == pytest.approx(0.5 * ROBOT.gravity, rel=1e-6)
    Simulator(diagram, context).AdvanceTo(0.002)


DEEP = 60
"""Calls upon calls, as in an import."""


class Scope:
    __name__ = "somewhere"


def template(base):
    @TemplateSystem.define("Nothing_", T_list=(float, AutoDiffXd), scope=Scope())
    def Nothing_(T):
        class Impl(base[T]):
            def _construct(self, converter=None):
                LeafSystem_[T].__init__(self, converter=converter)

            def _construct_copy(self, other, converter=None):
                Impl._construct(self, converter=converter)

        return Impl

    return Nothing_


def deeply(function, depth=DEEP):
    return deeply(function, depth - 1) if depth else function()


def test_drake_looks_through_a_short_stack_only(monkeypatch):
    frames, stack = [], inspect.stack

    def counted(*arguments):
        found = stack(*arguments)
        frames.append(len(found))
        return found

    monkeypatch.setattr(inspect, "stack", counted)
    nothing = template(LeafSystem_)
    made = deeply(lambda: class_for_floats(nothing))
    assert made is nothing[float]
    assert made().ToAutoDiffXd().num_output_ports() == 0
    assert max(frames, default=0) < DEEP // 2


def test_what_goes_wrong_in_a_template_is_said():
    with pytest.raises(RuntimeError, match="must inherit from"):
        class_for_floats(template({float: object, AutoDiffXd: object}))
