"""How blocks are asked for: robots by name, own forces, templates."""

import inspect

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem_
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.scalar_conversion import TemplateSystem

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.assembly import RobotBlock, add_cable_robot, apply_force
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.compiled_cable_robot import CompiledCableRobot
from cdpr_drake.systems.robots.templates import class_for_floats
from tests.systems.robots.test_refusals import NAMED_BLOCKS, in_own_plant

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
