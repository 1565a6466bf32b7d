"""The controller `mine`: run this file to see what it does, and its test to see that it does it."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

import cdpr_drake as cdpr
from cdpr_drake.geometry import cable_lengths

PERIOD = 0.01  # [s]


class Mine(LeafSystem):
    """Winds cables at a gain times what their lengths miss.

    Ports: in `lengths` (m,) [m], out `cable_velocities` (m,) [m/s]. It is sampled, as on a machine,
    so that it closes no algebraic loop with the robot.
    """

    def __init__(self, wanted, gain=2.0):
        super().__init__()
        self.wanted, self.gain = wanted, gain
        self.lengths = self.DeclareVectorInputPort("lengths", len(wanted))
        command = self.DeclareDiscreteState(len(wanted))
        self.DeclareStateOutputPort("cable_velocities", command)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self.law)

    def law(self, context, state):
        """The law: replace this by yours."""
        state.set_value(self.gain * (self.wanted - self.lengths.Eval(context)))


def distance_after(seconds, robot="acrobot_small"):
    """Simulates the robot from its home to a goal beside it; how far Po is from there [m]."""
    robot = cdpr.load_robot(robot)
    home = robot.home.transform()
    aside = np.array([0.05, -0.03, 0.05])
    goal = RigidTransform(home.rotation(), home.translation() + aside)
    cables = robot.cable_set()

    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", cdpr.CompiledCableRobot(robot))
    servo = builder.AddNamedSystem("mine", Mine(cable_lengths(goal, cables.p_WA, cables.p_PB)))
    builder.Connect(block.GetOutputPort("lengths"), servo.GetInputPort("lengths"))
    builder.Connect(servo.GetOutputPort("cable_velocities"), block.GetInputPort("cable_velocities"))
    diagram = builder.Build()

    simulator = Simulator(diagram)
    context = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    block.set_at_equilibrium(context, home)
    simulator.AdvanceTo(seconds)
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    return float(np.linalg.norm(X_WP.translation() - goal.translation()))


if __name__ == "__main__":
    for seconds in (0.5, 1.0, 2.0, 3.0):
        print(f"after {seconds} s: {1e3 * distance_after(seconds):.2f} mm away")
