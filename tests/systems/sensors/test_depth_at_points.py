"""Depths of a target's points: noise that grows with the square, limits, faults, late images."""

import numpy as np
import pytest
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.models.sensor_catalogue import load_depth_sensor
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.sensors.depth_at_points import DepthAtPoints
from cdpr_drake.vision.apriltags import TagTarget
from cdpr_drake.vision.pinhole import Pinhole

TAG = TagTarget(0, 0.12)
PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(49.5))
SEEN = np.radians([180.0, 0.0, 0.0])


def sensor(kind="kinect", **more):
    mounting = CameraMounting(RigidTransform(), RigidTransform())
    return DepthAtPoints(load_depth_sensor(kind), TAG, mounting, PINHOLE, 30.0, **more)


def at(distance):
    return pose_from_angles(np.array([0.0, 0.0, distance]), SEEN)


@pytest.mark.parametrize("distance", [1.0, 2.0, 4.0])
def test_noise_grows_with_the_square_of_depth(distance):
    """The 1.425 mm at 1 m of the Kinect, within five deviations of a deviation of 800 numbers."""
    reader = sensor()
    read = np.array([reader.measure(at(distance), number) for number in range(200)])
    expected = 1.425e-3 * distance**2
    assert np.std(read - distance) == pytest.approx(expected, rel=5.0 / np.sqrt(2.0 * read.size))


def test_outside_its_limits_or_the_image_it_reads_nothing():
    reader = sensor()
    np.testing.assert_array_equal(reader.measure(at(0.3), 1), 0.0)
    aside = pose_from_angles(np.array([5.0, 0.0, 1.0]), SEEN)
    np.testing.assert_array_equal(reader.measure(aside, 1), 0.0)


def test_late_as_its_camera_and_blind_with_it():
    reader = sensor(
        "ideal", latency_frames=1, fault=CameraFault(kind="dead", start=0.1, duration=0.05)
    )
    simulator = Simulator(reader)
    context = simulator.get_mutable_context()
    reader.GetInputPort("X_WP").FixValue(context, at(1.0))
    read = []
    for step in range(1, 7):
        simulator.AdvanceTo(step / 30.0 - 1e-6)
        read.append(float(reader.GetOutputPort("depths").Eval(context)[0]))
    # Images at 0 (twice, at the start), 1/30, ...; those of 3/30 and 4/30 are covered.
    assert read[1:] == pytest.approx([1.0, 1.0, 1.0, 0.0, 0.0])
