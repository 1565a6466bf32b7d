"""A controller of your own: a LeafSystem that winds cables until the platform is where you say.

Every 10 ms the cable velocities are a gain times what the lengths still miss, by the inverse
kinematics; replace the one line of `law` by yours. As it is sampled, it closes no algebraic loop.
"""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

import cdpr_drake as cdpr
from cdpr_drake.geometry import cable_lengths

PERIOD = 0.01  # [s]


class LengthServo(LeafSystem):
    """Cable velocities [m/s] from measured lengths [m]."""

    def __init__(self, wanted, gain):
        super().__init__()
        self.wanted, self.gain = wanted, gain
        self.lengths = self.DeclareVectorInputPort("lengths", len(wanted))
        command = self.DeclareDiscreteState(len(wanted))
        self.DeclareStateOutputPort("cable_velocities", command)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self.law)

    def law(self, context, state):
        state.set_value(self.gain * (self.wanted - self.lengths.Eval(context)))


robot = cdpr.load_robot("acrobot_small")
goal = RigidTransform(robot.home.transform().rotation(), [0.05, -0.03, 0.2])
cables = robot.cable_set()
wanted = cable_lengths(goal, cables.p_WA, cables.p_PB)

builder = DiagramBuilder()
block = builder.AddNamedSystem("robot", cdpr.CompiledCableRobot(robot))
servo = builder.AddNamedSystem("servo", LengthServo(wanted, gain=2.0))
builder.Connect(block.GetOutputPort("lengths"), servo.GetInputPort("lengths"))
builder.Connect(servo.GetOutputPort("cable_velocities"), block.GetInputPort("cable_velocities"))
diagram = builder.Build()

simulator = Simulator(diagram)
context = block.GetMyMutableContextFromRoot(simulator.get_mutable_context())
block.set_at_equilibrium(context, robot.home.transform())
for t in np.arange(0.5, 3.1, 0.5):
    simulator.AdvanceTo(t)
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    print(f"{t:.1f} s: {1e3 * np.linalg.norm(X_WP.translation() - goal.translation()):.2f} mm away")
