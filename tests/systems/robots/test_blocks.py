"""How blocks are asked for: robots and ports by name, their sizes, own forces, templates."""

import inspect

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem_
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.scalar_conversion import TemplateSystem

import cdpr_drake as cdpr
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.ups_robot import rod_masses
from cdpr_drake.systems.robots.assembly import RobotBlock, add_cable_robot, apply_force
from cdpr_drake.systems.robots.cable_forces import CableForces
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.motor_winch import COMMAND_PORTS, MotorWinch
from cdpr_drake.systems.robots.platform_pose import PlatformPose
from cdpr_drake.systems.robots.templates import class_for_floats
from cdpr_drake.systems.robots.tension_driven_cables import TensionDrivenCables
from cdpr_drake.systems.robots.ups_robot import UpsRobot
from cdpr_drake.systems.robots.winches import VelocityWinch
from tests.systems.robots.test_refusals import NAMED_BLOCKS
from tests.systems.robots.test_winches import HOME, LAW

NAME = "acrobot_small"
ROBOT = load_robot(NAME)


def in_own_plant(robot=NAME):
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(0.0))
    in_plant = cdpr.add_robot(plant, robot)
    plant.Finalize()
    return builder, in_plant


@pytest.mark.parametrize("what", NAMED_BLOCKS)
def test_blocks_take_a_name_in_place_of_a_robot(what):
    NAMED_BLOCKS[what](NAME)


def commanded(mode):
    return lambda: MotorWinch(LAW, mode, HOME)


MOTOR_OUTPUTS = [
    "unstrained_lengths", "unstrained_length_rates", "motor_angles", "motor_speeds",
    "applied_torques", "friction_torques",
]  # fmt: skip
PORTS = {
    "CableForces": (
        lambda: CableForces(in_own_plant("planar")[1]),
        {"platform_state": 6, "unstrained_lengths": 4, "unstrained_length_rates": 4},
        {"generalized_force": 3, "tensions": 4, "force_and_drums": 7, "drum_tensions": 4,
         "lengths": 4, "slack": 4, "surplus_lengths": 4, "sags": 4},
    ),
    "TensionDrivenCables": (
        lambda: TensionDrivenCables(in_own_plant("caroca")[1]),
        {"platform_state": 13, "tensions": 8},
        {"generalized_force": 6, "lengths": 8, "length_rates": 8, "slack": 8},
    ),
    "TensionDrivenCables in a plane": (
        lambda: TensionDrivenCables(in_own_plant("planar")[1]),
        {"platform_state": 6, "tensions": 4},
        {"generalized_force": 3, "lengths": 4, "length_rates": 4, "slack": 4},
    ),
    "PlatformPose": (
        lambda: PlatformPose(in_own_plant()[1]), {"platform_state": 13}, {"X_WP": 0}
    ),
    "PlatformPose in a plane": (
        lambda: PlatformPose(in_own_plant("planar")[1]), {"platform_state": 6}, {"X_WP": 0}
    ),
    "VelocityWinch": (
        lambda: VelocityWinch(np.zeros(3), 0.5),
        {"cable_velocities": 3},
        {"unstrained_lengths": 3, "unstrained_length_rates": 3},
    ),
    **{
        f"MotorWinch by {mode}": (
            commanded(mode), {name: 2, "tensions": 2}, dict.fromkeys(MOTOR_OUTPUTS, 2)
        )
        for mode, name in COMMAND_PORTS.items()
    },
    "UpsRobot": (lambda: UpsRobot(ROBOT, rod_masses(ROBOT), 1e-3), {"tensions": 8}, {"X_WP": 0}),
}  # fmt: skip


@pytest.mark.parametrize("block", PORTS)
def test_ports_are_these(block):
    make, inputs, outputs = PORTS[block]
    system = make()
    found = [system.get_input_port(i) for i in range(system.num_input_ports())]
    required = {p.get_name(): p.size() for p in found if p.get_name() != "brakes"}
    assert required == inputs
    found = [system.get_output_port(i) for i in range(system.num_output_ports())]
    assert {port.get_name(): port.size() for port in found} == outputs
    if "X_WP" in outputs:
        value = system.GetOutputPort("X_WP").Allocate().get_value()
        assert isinstance(value, RigidTransform)


def test_parts_of_a_robot_have_names_and_its_state_a_size():
    block = CableRobot(ROBOT)
    for name in ("plant", "scene_graph", "cables", "winches", "platform_pose"):
        assert block.GetSubsystemByName(name).get_name() == name
    assert block.GetOutputPort("platform_state").size() == 13


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


def test_public_names_of_what_signatures_name():
    for name in ("TaskGains", "ServoLaw", "BelievedRobot", "Read", "InertialSensor", "RobotBlock"):
        assert name in cdpr.__all__
        assert getattr(cdpr, name) is not None


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
