"""The tag detector on drawn images: what it finds, when, and the ports that cameras share."""

import cv2
import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import PortDataType
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_measurement import TargetDetector
from cdpr_drake.vision.apriltags import BORDERED_CELLS, TAG_CELLS, TagTarget, tag_corners, tag_png
from cdpr_drake.vision.pinhole import Pinhole

CORNER_OFFSET = 0.5
"""A corner found in a drawn image [px]; OpenCV's refinement leaves a tenth, at times three."""

POSE_DISTANCE = 1e-3
"""Distance of X_CO [m] at 0.4 m: a tenth of a pixel on a tag of 110 px is 0.4 mm."""

POSE_ANGLE = np.radians(0.6)
"""Angle of X_CO that such corners allow."""

RATE = 25.0
SIZE = 0.1
PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))

FINER = 4
"""Images are drawn this much larger and then averaged, so that edges are smooth."""


def facing(x, y, turn=0.2):
    """X_CO of a tag that nearly faces the camera, 0.4 m before it."""
    return pose_from_angles(np.array([x, y, 0.4]), np.array([np.pi + 0.3, -0.2, turn]))


def drawn(X_CO, tag_id):
    """What the camera sees of a tag on a grey ground."""
    picture = cv2.imdecode(np.frombuffer(tag_png(tag_id), np.uint8), cv2.IMREAD_GRAYSCALE)
    cell = picture.shape[0] / BORDERED_CELLS
    low, high = cell - 0.5, (BORDERED_CELLS - 1) * cell - 0.5
    assert high - low == TAG_CELLS * cell
    source = np.array([[low, low], [high, low], [high, high], [low, high]], np.float32)
    corners = PINHOLE.project(X_CO.multiply(tag_corners(SIZE))).T
    finer = (FINER * corners + (FINER - 1) / 2.0).astype(np.float32)
    big = cv2.warpPerspective(
        picture,
        cv2.getPerspectiveTransform(source, finer),
        (FINER * PINHOLE.width, FINER * PINHOLE.height),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=128,
    )
    gray = cv2.resize(big, (PINHOLE.width, PINHOLE.height), interpolation=cv2.INTER_AREA)
    image = ImageRgba8U(PINHOLE.width, PINHOLE.height)
    image.mutable_data[:] = gray[:, :, np.newaxis]
    return image


def watching(detector, image):
    """A simulator of the detector with this image before it."""
    simulator = Simulator(detector)
    context = simulator.get_mutable_context()
    detector.GetInputPort("color_image").FixValue(context, Value(image))
    return simulator


def test_ports_are_these():
    detector = TargetDetector(TagTarget(0, SIZE), PINHOLE, RATE)
    assert detector.num_input_ports() == 1
    port = detector.GetInputPort("color_image")
    assert port.get_data_type() == PortDataType.kAbstractValued
    assert isinstance(detector.AllocateInputAbstract(port).get_value(), ImageRgba8U)


def test_measurements_have_the_ports_of_the_projected_camera():
    projected = ProjectedCamera(TagTarget(0, SIZE), CameraMounting(RigidTransform()), PINHOLE, RATE)
    ports = [
        [
            (port.get_name(), port.get_data_type(), port.size(), type(port.Allocate().get_value()))
            for port in (system.get_output_port(i) for i in range(system.num_output_ports()))
        ]
        for system in (TargetDetector(TagTarget(0, SIZE), PINHOLE, RATE), projected)
    ]
    assert ports[0] == ports[1]
    assert [port[0] for port in ports[0]] == ["corners", "X_CO", "found"]


@pytest.mark.parametrize("turn", [0.2, 1.8, -2.7])
def test_a_tag_is_found_with_its_corners_and_pose(turn):
    X_CO = facing(0.05, -0.04, turn)
    detector = TargetDetector(TagTarget(11, SIZE), PINHOLE, RATE)
    simulator = watching(detector, drawn(X_CO, 11))
    simulator.AdvancePendingEvents()
    context = simulator.get_context()
    assert detector.GetOutputPort("found").Eval(context) == 1.0
    corners = detector.GetOutputPort("corners").Eval(context).reshape(4, 2).T
    offset = corners - PINHOLE.project(X_CO.multiply(tag_corners(SIZE)))
    assert np.all(np.linalg.norm(offset, axis=0) < CORNER_OFFSET)
    distance, angle = pose_error(X_CO, detector.GetOutputPort("X_CO").Eval(context))
    assert distance < POSE_DISTANCE
    assert angle < POSE_ANGLE


def not_found(detector, image):
    simulator = watching(detector, image)
    simulator.AdvancePendingEvents()
    context = simulator.get_context()
    np.testing.assert_array_equal(detector.GetOutputPort("corners").Eval(context), np.zeros(8))
    assert detector.GetOutputPort("X_CO").Eval(context).IsExactlyIdentity()
    return detector.GetOutputPort("found").Eval(context)[0] == 0.0


def test_other_tags_and_half_tags_are_not_found():
    detector = TargetDetector(TagTarget(11, SIZE), PINHOLE, RATE)
    assert not_found(detector, drawn(facing(0.0, 0.0), 12))
    assert not_found(detector, drawn(facing(0.24, 0.0), 11))
    mirrored = drawn(facing(0.0, 0.0), 11)
    mirrored.mutable_data[:] = mirrored.data[:, ::-1].copy()
    assert not_found(detector, mirrored)


@pytest.mark.parametrize("frames", [0, 2])
def test_latency_of_some_frames_delays_by_as_many_periods(frames):
    detector = TargetDetector(TagTarget(3, SIZE), PINHOLE, RATE, frames)
    poses = [facing(0.02 * number, 0.0) for number in range(5)]
    simulator = watching(detector, drawn(poses[0], 3))
    context = simulator.get_mutable_context()
    for number, X_CO in enumerate(poses):
        image = drawn(X_CO, 3)
        detector.GetInputPort("color_image").FixValue(context, Value(image))
        simulator.AdvanceTo((number + 0.5) / RATE)
        found = detector.GetOutputPort("found").Eval(context)[0]
        assert found == float(number >= frames)
        if found:
            distance, _ = pose_error(
                poses[number - frames], detector.GetOutputPort("X_CO").Eval(context)
            )
            assert distance < POSE_DISTANCE
