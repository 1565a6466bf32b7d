"""What a robot, its cables, winches, pushes and failures cannot do is refused in one line."""

import math

import numpy as np
import pytest
import yaml
from pydrake.common import RandomGenerator
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

import cdpr_drake as cdpr
from cdpr_drake.analyses.workspaces.servo_stability import stability_case
from cdpr_drake.cables.cable_behaviour import CableBehaviour, behaving_cables
from cdpr_drake.errors import (
    CableGeometryError,
    CableModelError,
    CdprError,
    InfeasibleTensionError,
    RobotFileError,
    ScenarioError,
    StabilityError,
    TensionProblemError,
)
from cdpr_drake.models.robot_holding import check_bundles
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.models.ups_robot import add_ups_robot, rod_masses
from cdpr_drake.schema.typed_yaml import refuse
from cdpr_drake.systems.batches.batch_robots import BatchRobots
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.robots.assembly import add_cable_robot
from cdpr_drake.systems.robots.cable_forces import CableForces, simulated_cables
from cdpr_drake.systems.robots.cable_robot import (
    CableRobot,
    automatic_step,
    default_rule,
    holding_tensions,
)
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot, motion_by_tensions
from cdpr_drake.systems.robots.compiled_step import StepRule
from cdpr_drake.systems.robots.failures import Equipment, Failure, FailureSettings
from cdpr_drake.systems.robots.random_pose import RandomPose
from cdpr_drake.systems.robots.settings import CableSettings
from cdpr_drake.systems.robots.ups_robot import UpsRobot
from cdpr_drake.workspaces.pose_grid import WorkspaceGrid
from tests.models.robots import content_of, robot_of
from tests.motion.small_robots import content, small_robot
from tests.systems.robots.engines import (
    ALL_BEHAVIOUR,
    behaving,
    bundled,
    fix_commands,
    parallelograms,
    rubbing,
    settings_of,
)

SMALL = load_robot("acrobot_small")
HOME = SMALL.home.transform()


def without_inertia():
    robot = content_of()
    del robot["winch"]["inertia"]
    return robot_of(robot)


def initialized(block):
    """After a random context, as a simulator begins."""
    context = block.CreateDefaultContext()
    block.SetRandomContext(context, RandomGenerator(1))
    fix_commands(block, context)
    Simulator(block, context).Initialize()


def commanded_continuously(port_name):
    builder = DiagramBuilder()
    block = builder.AddSystem(CompiledCableRobot(SMALL, command_period=math.inf))
    for index in range(block.num_input_ports()):
        port = block.get_input_port(index)
        scale = 0.02 if port.get_name() == port_name else 0.0
        values = np.outer(np.ones(port.size()), [0.0, scale])
        ramp = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], values)
        if scale:
            source = builder.AddSystem(TrajectorySource(ramp))
            builder.Connect(source.get_output_port(), port)
        else:
            builder.ExportInput(port, port.get_name())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    for index in range(diagram.num_input_ports()):
        port = diagram.get_input_port(index)
        port.FixValue(context, np.zeros(port.size()))
    Simulator(diagram, context).AdvanceTo(0.1)


def with_a_ball():
    def add_ball(builder, in_plant, scene_graph):
        ball = SpatialInertia.SolidSphereWithMass(0.5, 0.05)
        in_plant.plant.AddRigidBody("ball", in_plant.plant.AddModelInstance("toys"), ball)

    CompiledCableRobot(SMALL, add_to_scene=add_ball)


def on_the_axis_of_a_pulley():
    block = CompiledCableRobot(SMALL, settings_of(pulleys=True))
    context = block.CreateDefaultContext()
    fix_commands(block, context)
    cables = block.forces.cable_set()
    X_WP = RigidTransform(cables.p_WA[:, 0] - cables.p_PB[:, 0])
    block.motion.hold(block.motion.GetMyMutableContextFromRoot(context), X_WP, np.ones(8), None)
    Simulator(block, context).AdvanceTo(0.1)


def in_a_groove():
    block = CableRobot(SMALL, settings_of(pulleys=True))
    context = block.CreateDefaultContext()
    fix_commands(block, context)
    cable = SMALL.cables[1]
    X_WP = RigidTransform(
        HOME.rotation(), cable.exit_point - cable.anchor_point + [0.0045, 0.0, 0.0]
    )
    block.in_plant.set_pose(block.GetMutableSubsystemContext(block.plant, context), X_WP)
    block.EvalTimeDerivatives(context)


def in_own_plant(robot="acrobot_small"):
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = cdpr.add_robot(plant, robot)
    plant.Finalize()
    return builder, in_plant


def swapped():
    builder, in_plant = in_own_plant()
    add_cable_robot(in_plant, builder)


def plain_plant():
    builder, in_plant = in_own_plant()
    add_cable_robot(builder, in_plant.plant)


def bundle_of_two_materials():
    robot = parallelograms()
    robot["cables"][1]["material"] = {"diameter": 0.003}
    robot_of(robot)


def semi_implicit_bundles():
    block = CompiledCableRobot(bundled(), settings_of("torque"))
    block.integrate_by(StepRule(method="semi_implicit", max_step=1e-3))


def bundles_turned():
    robot = bundled()
    turned = RigidTransform(RollPitchYaw(0.0, 0.2, 0.3), robot.home.position)
    check_bundles(robot, robot.cable_set(), turned)


def stability_of_bundles():
    grid = WorkspaceGrid(([0.0], [0.0], [0.4]), np.zeros((1, 3)))
    stability_case(bundled(), "pbvs", grid)


def behaving_set(pulleys=True):
    robot = behaving(load_robot("acrobot_large"), **ALL_BEHAVIOUR)
    return CableSettings(pulleys=pulleys).cable_set(robot)


def rubbing_over_platform_pulleys():
    up = np.tile([[0.0], [0.0], [1.0]], 8)
    simulated_cables(behaving_set().over_platform_pulleys(0.02, up), "elastic")


def hysteresis_of(name):
    small_robot(name, platform=content(name)["platform"] | {"hysteresis": {"tilt": 1.0}})


NAMED_BLOCKS = {
    "CableRobot": CableRobot,
    "CompiledCableRobot": CompiledCableRobot,
    "UpsRobot": lambda robot: UpsRobot(robot, rod_masses(SMALL), 1e-4),
    "add_robot": in_own_plant,
    "motion_by_tensions": lambda robot: motion_by_tensions(robot, SMALL.cable_set()),
    "BatchRobots": lambda robot: BatchRobots(robot, 1),
    "automatic_step": lambda robot: automatic_step(robot, HOME, "runge_kutta3"),
    "default_rule": default_rule,
}


def overridden(scenario, override):
    load_scenario(scenario, [override])


HAS = Equipment(8, 7, motors=False, sensors=("tension", "tracker"))
"""What may fail of the robot in `EVENTS`."""


def fails(second):
    first = Failure(kind="cable_breaks", time=0.0, cable=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Equipment, "of", lambda scenario, robot: HAS)
        refuse(FailureSettings(events=[first, second]), "failures", error=ScenarioError)


EVENT = r"failures\.events\[1\]\."

ROBOT_FILES = {
    "motors": (
        lambda: CableRobot(without_inertia(), settings_of("velocity")),
        r"acrobot_small: winch\.inertia: found null",
    ),
    "bundled materials": (
        bundle_of_two_materials, r"cables\[1\]\.material\.diameter: found 0\.003 on"
    ),
    **{
        f"hysteresis of {name}": (
            lambda name=name: hysteresis_of(name), r"platform\.hysteresis: found a section for"
        )
        for name in ("pendulum", "level_point", "lift", "beam")
    },
    "rods in a plane": (
        lambda: add_ups_robot(MultibodyPlant(1e-3), load_robot("planar"), np.ones(4)),
        "robot planar: motion: found 2T1R; accepted",
    ),
    **{
        f"misspelt for {name}": (
            lambda make=make: make("acrobot_smal"), "did you mean acrobot_small"
        )
        for name, make in NAMED_BLOCKS.items()
    },
    **{
        f"number for {name}": (
            lambda make=make: make(0.5), "found a float; accepted: a name, a path or a Robot"
        )
        for name, make in NAMED_BLOCKS.items()
    },
}  # fmt: skip

CABLE_MODELS = {
    "spread of few cables": (
        lambda: CableRobot(load_robot("grab_three"), random_pose=RandomPose()),
        "random_pose of grab_three",
    ),
    "behaving catenaries": (
        lambda: simulated_cables(behaving_set(), "catenary"),
        "found catenary .* cable.behaviour; accepted: el",
    ),
    "behaving and stiff": (
        lambda: simulated_cables(behaving_set(), "inextensible"),
        "found inextensible .* cable.behaviour",
    ),
    "platform pulleys": (rubbing_over_platform_pulleys, "sheave_friction: found 0.05 with pulleys"),
    "creep time": (
        lambda: behaving_cables(
            behaving_set(), CableBehaviour(creep_stiffness=0.1, creep_time=0.0)
        ),
        "creep_time: found 0; accepted: > 0",
    ),
    "stiffening": (
        lambda: behaving_cables(behaving_set(), CableBehaviour(stiffening=-1.0)),
        "stiffening: found -1; accepted: >= 0",
    ),
    "undetermined": (
        lambda: CableForces(in_own_plant()[1], None, "inextensible"),
        "tensions do not follow from its length",
    ),
    "rods without mass": (
        lambda: add_ups_robot(MultibodyPlant(1e-3), load_robot("caroca"), np.zeros(8)),
        "masses of rods: found .*; accepted: 8 numbers > 0",
    ),
}  # fmt: skip

GEOMETRY = {
    "axis of a pulley": (on_the_axis_of_a_pulley, "cable 1"),
    "groove": (in_a_groove, "at 0 s: cable 2: its anchor point"),
    "bundled pose": (bundles_turned, "P0a and P0b of .* on one winch, which pays out"),
}  # fmt: skip

EVENTS = {
    "cable: found none with cable_breaks": Failure(time=0.0, kind="cable_breaks"),
    "cable: found 8; accepted: 0 to 7": Failure(time=0.0, kind="cable_breaks", cable=8),
    "winch: found 7; accepted: 0 to 6": Failure(time=0.0, kind="winch_jams", winch=7),
    "cable: found 1 with winch_jams": Failure(time=0.0, kind="winch_jams", cable=1, winch=1),
    r"delay: found 0\.1 with cable": Failure(time=0.0, kind="cable_breaks", cable=1, delay=0.1),
    "kind: found power_lost with ideal": Failure(time=0.0, kind="power_lost", winch=1),
    "sensor: found none with sensor_freezes": Failure(time=0.0, kind="sensor_freezes"),
    "sensor: found encoder; accepted: tension, tracker":
        Failure(time=0.0, kind="sensor_freezes", sensor="encoder"),
    "delay: found none with message_late; accepted: a number of seconds":
        Failure(time=0.0, kind="message_late", sensor="tension"),
    "sensor: found none with message_late; accepted: tension, tracker":
        Failure(time=0.0, kind="message_late", delay=0.1),
    "cable: found 1 with tracker; accepted: null":
        Failure(time=0.0, kind="sensor_freezes", sensor="tracker", cable=1),
}  # fmt: skip
OVERRIDES = {
    r"cables\.model: .*inextensible": ("acrobot_pbvs", "cables.model=inextensible"),
    r"winches\.kind: found hydraulic; accepted: one of ideal, motor":
        ("acrobot_friction", "winches.kind=hydraulic"),
    r"integration\.max_step: found 0\.0021; accepted: at most 0\.002 \[s\], twice the":
        ("acrobot_friction", "integration.max_step=0.0021"),
    r"winches\.mode: found position with ideal winches": ("acrobot_pbvs", "winches.mode=position"),
    "cable_thaws":
        ("acrobot_broken_cable", "failures.events=[{kind: cable_thaws, time: 1.0, cable: 1}]"),
}  # fmt: skip
SCENARIOS = {
    **{words: (lambda event=event: fails(event), EVENT + words) for words, event in EVENTS.items()},
    **{words: (lambda case=case: overridden(*case), words) for words, case in OVERRIDES.items()},
}  # fmt: skip

BLOCKS = {
    "continuous velocities": (
        lambda: commanded_continuously("cable_velocities"),
        "cable_velocities of acrobot_small: .* or a command_period",
    ),
    "continuous wrench": (
        lambda: commanded_continuously("applied_wrench"),
        "applied_wrench of acrobot_small: .* or a command_period",
    ),
    "command period": (
        lambda: CompiledCableRobot(SMALL, command_period=0.0),
        "command_period: found 0 s; accepted: more than 0",
    ),
    "spread": (
        lambda: RandomPose(position=[-1, 0, 0]), r"RandomPose\.position: found \[-1, 0, 0\]"
    ),
    "more bodies": (with_a_ball, "found 3 bodies .* need the engine plant"),
    "input port": (
        lambda: add_cable_robot(*in_own_plant()).GetInputPort("cable_velocity"),
        "did you mean cable_velocities.*: applied_wr",
    ),
    "output port": (
        lambda: add_cable_robot(*in_own_plant()).GetOutputPort("tension"), "did you mean tensions"
    ),
    "builder": (swapped, "builder: found a RobotInPlant; accepted: a Diagram"),
    "in_plant": (plain_plant, "in_plant: found a MultibodyPlant; accepted: a RobotInP"),
    "bundled method": (semi_implicit_bundles, "semi_implicit for motors with several cables"),
    "batch with hysteresis": (
        lambda: BatchRobots(rubbing(SMALL, 3.0, 5.0, 0.08), 2),
        r"platform\.hysteresis: found a section",
    ),
}  # fmt: skip

OTHERS = {
    InfeasibleTensionError: {
        "pose": (
            lambda: holding_tensions(SMALL, RigidTransform([0.55, 0.55, 0.3])),
            r"acrobot_small cannot hold .* 0\.55",
        ),
    },
    TensionProblemError: {
        "spread too far": (
            lambda: initialized(CableRobot(SMALL, random_pose=RandomPose(position=[3.0, 3.0, 0]))),
            "acrobot_small",
        ),
    },
    StabilityError: {
        "bundled certificate": (
            stability_of_bundles,
            "several cables on one winch; accepted: a winch for",
        ),
    },
}

REFUSALS = {
    RobotFileError: ROBOT_FILES,
    CableModelError: CABLE_MODELS,
    CableGeometryError: GEOMETRY,
    ScenarioError: SCENARIOS,
    CdprError: BLOCKS,
    **OTHERS,
}


ROWS = [
    pytest.param(error, *row, id=name)
    for error, rows in REFUSALS.items()
    for name, row in rows.items()
]


@pytest.mark.parametrize(("error", "call", "words"), ROWS)
def test_refusal(error, call, words):
    with pytest.raises(error, match=words) as caught:
        call()
    assert isinstance(caught.value, CdprError)
    assert len(str(caught.value).splitlines()) == 1


def test_a_scenario_refuses_what_its_robot_file_lacks(tmp_path):
    text = robot_file("acrobot_small").read_text().replace("radius: 0.0045", "radius: 0.9")
    (tmp_path / "robot.yaml").write_text(text)
    override = f"robot={tmp_path / 'robot.yaml'}"
    load_scenario("acrobot_pbvs", [override])
    with pytest.raises(ScenarioError, match="cables: cable 1"):
        load_scenario("acrobot_pbvs", [override, "cables.pulleys=true"])
    without = content_of()
    del without["winch"]["inertia"]
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(without))
    with pytest.raises(ScenarioError, match=r"winches\.kind: robot acrobot_small: w"):
        load_scenario("acrobot_friction", [override])
