"""A head on two joints: where it looks, how fast it turns, a loop that keeps a target in view."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import BasicVector, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import ConstantVectorSource

from cdpr_drake.errors import SensorError
from cdpr_drake.sections.perception.head import PanTilt, PanTiltJoints, head_pose
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.pinhole import Pinhole

JOINTS = PanTiltJoints(
    lower=np.radians([-90.0, -40.0]), upper=np.radians([90.0, 60.0]), speed=np.array([1.0, 0.5])
)


def turned(command, duration, mode="velocity", joints=JOINTS, **options):
    builder = DiagramBuilder()
    head = builder.AddSystem(PanTilt(joints, RigidTransform(), mode=mode, **options))
    source = builder.AddSystem(ConstantVectorSource(np.array(command, float)))
    builder.Connect(source.get_output_port(), head.GetInputPort("command"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(duration)
    own = head.GetMyContextFromRoot(simulator.get_context())
    return head, own


def test_pan_looks_to_the_right_and_tilt_upwards():
    """In M: z ahead, x to the right, y down."""
    ahead = np.array([0.0, 0.0, 1.0])
    right = head_pose(RigidTransform(), np.zeros(3), np.array([0.5, 0.0])).rotation() @ ahead
    up = head_pose(RigidTransform(), np.zeros(3), np.array([0.0, 0.5])).rotation() @ ahead
    np.testing.assert_allclose(right, [np.sin(0.5), 0.0, np.cos(0.5)], atol=1e-15)
    np.testing.assert_allclose(up, [0.0, -np.sin(0.5), np.cos(0.5)], atol=1e-15)
    arm = head_pose(RigidTransform([1.0, 0, 0]), np.array([0.0, 0.0, 0.2]), np.array([0.5, 0.0]))
    np.testing.assert_allclose(arm.translation(), [1.0 + 0.2 * np.sin(0.5), 0, 0.2 * np.cos(0.5)])


@pytest.mark.parametrize(
    ("mode", "command", "duration", "angles"),
    [
        ("velocity", [0.3, -0.2], 1.234, [0.3702, -0.2468]),
        ("velocity", [2.0, -3.0], 1.0, [1.0, -0.5]),
        ("velocity", [2.0, -3.0], 5.0, [np.pi / 2, JOINTS.lower[1]]),
        ("position", [0.4, 9.0], 0.3, [0.3, 0.15]),
        ("position", [0.4, 9.0], 4.0, [0.4, JOINTS.upper[1]]),
    ],
)
def test_a_head_turns_as_fast_as_it_can_and_stops_at_its_goal_and_limits(
    mode, command, duration, angles
):
    head, own = turned(command, duration, mode)
    np.testing.assert_allclose(head.GetOutputPort("angles").Eval(own), angles)


def test_encoders_count_and_begin_where_they_believe_zero_to_be():
    joints = replace(JOINTS, counts_per_turn=1000, zero_error=0.01)
    head, own = turned([0.3, 0.2], 0.777, joints=joints, seed=4)
    step = 2.0 * np.pi / 1000
    read = head.GetOutputPort("encoder_angles").Eval(own)
    np.testing.assert_allclose(read / step, np.round(read / step), atol=1e-9)
    off = head.GetOutputPort("angles").Eval(own) - read
    assert 0.5 * step < np.max(np.abs(off)) < 0.05
    believed = head.GetOutputPort("X_BH_encoder").Eval(own)
    assert believed.IsExactlyEqualTo(head.head(read))
    again, same = turned([0.3, 0.2], 0.777, joints=joints, seed=4)
    np.testing.assert_array_equal(again.GetOutputPort("encoder_angles").Eval(same), read)


@pytest.mark.parametrize(
    ("options", "words"),
    [({"mode": "torque"}, "mode: found 'torque'"), ({"rate": 0.0}, "rate of a pan-tilt")],
)
def test_what_cannot_be_is_refused(options, words):
    with pytest.raises(SensorError, match=words):
        PanTilt(JOINTS, RigidTransform(), **options)


class Follow(LeafSystem):
    """Turns the head towards the middle of what the camera sees, in proportion."""

    def __init__(self, pinhole, gain):
        super().__init__()
        self.DeclareVectorInputPort("corners", 8)
        self.DeclareVectorInputPort("found", 1)
        self._pinhole, self._gain = pinhole, gain
        self.DeclareVectorOutputPort("rates", 2, self._calc)

    def _calc(self, context, output: BasicVector):
        u, v = self.get_input_port(0).Eval(context).reshape(-1, 2).mean(axis=0)
        seen = self.get_input_port(1).Eval(context)[0]
        x, y = (u - self._pinhole.cx) / self._pinhole.fx, (v - self._pinhole.cy) / self._pinhole.fy
        output.SetFromVector(seen * self._gain * np.array([x, -y]))


class Passing(LeafSystem):
    """A target 2 m ahead that passes to the right at 0.2 m/s, facing the platform."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractOutputPort("X_WO", lambda: Value(RigidTransform()), self._calc)

    def _calc(self, context, output):
        R = RotationMatrix.MakeXRotation(np.pi)
        output.set_value(RigidTransform(R, [-0.3 + 0.2 * context.get_time(), -0.2, 2.0]))


def test_a_camera_on_it_keeps_a_passing_target_in_the_middle():
    """The projected camera sits on a head in the world, and its image turns the head."""
    pinhole, gain = Pinhole(640, 480, 500.0, 500.0, 319.5, 239.5), 6.0
    builder = DiagramBuilder()
    head = builder.AddSystem(PanTilt(JOINTS, RigidTransform(), mode="velocity", rate=50.0))
    camera = builder.AddSystem(
        ProjectedCamera(DotTarget(0.1), CameraMounting(RigidTransform()), pinhole, 50.0)
    )
    follow = builder.AddSystem(Follow(pinhole, gain))
    target = builder.AddSystem(Passing())
    builder.Connect(head.GetOutputPort("X_BH"), camera.GetInputPort("X_WP"))
    builder.Connect(target.GetOutputPort("X_WO"), camera.GetInputPort("X_WO"))
    for port in ("corners", "found"):
        builder.Connect(camera.GetOutputPort(port), follow.GetInputPort(port))
    builder.Connect(follow.GetOutputPort("rates"), head.GetInputPort("command"))
    simulator = Simulator(builder.Build())
    root = simulator.get_context()
    simulator.AdvanceTo(4.0)
    angles = head.GetOutputPort("angles").Eval(head.GetMyContextFromRoot(root))
    x = -0.3 + 0.2 * 4.0
    # It lags by what a proportional law leaves: the rate of the direction over the gain.
    rate = 0.2 * 2.0 / (x**2 + 4.0)
    assert angles[0] == pytest.approx(np.arctan2(x, 2.0) - rate / gain, abs=0.004)
    assert angles[1] == pytest.approx(np.arctan2(0.2, np.hypot(x, 2.0)), abs=0.004)


def test_encoders_read_an_offset_and_noise_that_change_with_each_look():
    wrong = replace(JOINTS, offset=np.array([0.02, -0.03]), noise=1e-3, counts_per_turn=10**7)
    read = []
    for duration in (0.5001, 0.5101, 0.5101):
        head, own = turned([0.0, 0.0], duration, joints=wrong, start=np.array([0.2, 0.1]))
        read.append(head.GetOutputPort("encoder_angles").Eval(own))
        np.testing.assert_allclose(head.GetOutputPort("angles").Eval(own), [0.2, 0.1])
    np.testing.assert_array_equal(read[1], read[2])
    assert np.all(read[0] != read[1])
    # Five standard deviations.
    np.testing.assert_allclose(read, np.tile([0.22, 0.07], (3, 1)), atol=5e-3)
