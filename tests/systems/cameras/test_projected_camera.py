"""The projected camera: what it sees, when, and with which noise."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.vision.apriltags import TagTarget, tag_corners
from cdpr_drake.vision.pinhole import Pinhole

SOLVER = 1e-5
"""Distance [m] and angle [rad] that the iterative pose solver leaves on exact corners."""

ROUND_OFF = 1e-9
"""Of pixel coordinates up to 1e3 [px]."""

NOISE_SHARE = 0.05
"""Relative uncertainty of a standard deviation from 4000 numbers, three times over."""

RATE = 25.0
SIZE = 0.1
PINHOLE = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))

X_BC = pose_from_angles(np.array([0.01, 0.02, -0.03]), np.array([np.pi, 0.0, 0.3]))
X_WO = pose_from_angles(np.array([0.05, -0.02, 0.0]), np.array([0.1, -0.05, 0.5]))


def X_WB_at(time):
    """The camera's body flies over the tag and turns."""
    return pose_from_angles(
        np.array([0.1 * time, -0.05 * time, 0.5]), np.array([0.1, 0.2 * time, 0.0])
    )


def camera(**settings):
    """A camera on a platform that looks at a tag."""
    return ProjectedCamera(TagTarget(0, SIZE), CameraMounting(X_BC), PINHOLE, RATE, **settings)


def looking_from(system, X_WB, X_WO=X_WO):
    """A context of the camera with its platform at X_WB and the tag at X_WO."""
    context = system.CreateDefaultContext()
    system.GetInputPort("X_WP").FixValue(context, Value(X_WB))
    system.GetInputPort("X_WO").FixValue(context, Value(X_WO))
    return context


class Carrier(LeafSystem):
    """Puts the poses of platform and tag on ports, as the robot's block does."""

    def __init__(self):
        super().__init__()
        for name, pose in (("X_WP", X_WB_at), ("X_WO", lambda time: X_WO)):
            self.DeclareAbstractOutputPort(
                name,
                lambda: Value(RigidTransform()),
                lambda context, output, pose=pose: output.set_value(pose(context.get_time())),
            )


class Reader(LeafSystem):
    """Writes down what a controller of this rate reads in its discrete updates."""

    def __init__(self, rate):
        super().__init__()
        self.read = []
        found = self.DeclareVectorInputPort("found", 1)
        X_CO = self.DeclareAbstractInputPort("X_CO", Value(RigidTransform()))
        self.DeclareDiscreteState(1)
        # A copy of the pose, since the port's own value changes with the next image.
        self.DeclarePeriodicDiscreteUpdateEvent(
            1.0 / rate,
            0.0,
            lambda context, state: self.read.append(
                (context.get_time(), found.Eval(context)[0], RigidTransform(X_CO.Eval(context)))
            ),
        )


def read_while_moving(duration, reader_rate=RATE, **settings):
    """What a `Reader` notes while the camera moves."""
    builder = DiagramBuilder()
    # The reader stands before what it reads, so the order of adding does not help.
    reader = builder.AddSystem(Reader(reader_rate))
    system = builder.AddSystem(camera(**settings))
    carrier = builder.AddSystem(Carrier())
    for name in ("X_WP", "X_WO"):
        builder.Connect(carrier.GetOutputPort(name), system.GetInputPort(name))
    for name in ("found", "X_CO"):
        builder.Connect(system.GetOutputPort(name), reader.GetInputPort(name))
    Simulator(builder.Build()).AdvanceTo(duration)
    return reader.read


def test_corners_are_the_pinhole_s_and_give_back_the_pose():
    system = camera()
    X_WB = X_WB_at(0.3)
    X_CO = (X_WB @ X_BC).inverse() @ X_WO
    simulator = Simulator(system, looking_from(system, X_WB))
    simulator.AdvancePendingEvents()
    context = simulator.get_context()
    assert system.GetOutputPort("found").Eval(context) == 1.0
    corners = system.GetOutputPort("corners").Eval(context).reshape(4, 2)
    for corner, p_OK in zip(corners, tag_corners(SIZE).T, strict=True):
        x, y, z = X_CO.multiply(p_OK)
        expected = [PINHOLE.cx + PINHOLE.fx * x / z, PINHOLE.cy + PINHOLE.fy * y / z]
        np.testing.assert_allclose(corner, expected, atol=ROUND_OFF)
    assert max(pose_error(X_CO, system.GetOutputPort("X_CO").Eval(context))) < SOLVER


def test_nothing_is_found_before_the_first_image():
    system = camera()
    context = looking_from(system, X_WB_at(0.0))
    assert system.GetOutputPort("found").Eval(context) == 0.0


@pytest.mark.parametrize(("frames", "faster"), [(0, 1), (1, 1), (3, 1), (0, 2)])
def test_latency_of_some_frames_delays_by_as_many_periods(frames, faster):
    """Without latency, an update at time t reads the image of time t; a faster reader reads the
    last image again."""
    read = read_while_moving(0.4, faster * RATE, latency_frames=frames)
    for number, (time, found, X_CO) in enumerate(read):
        assert time == pytest.approx(number / (faster * RATE))
        image = number // faster - frames
        assert found == float(image >= 0)
        if found:
            expected = (X_WB_at(image / RATE) @ X_BC).inverse() @ X_WO
            assert max(pose_error(expected, X_CO)) < SOLVER


def test_noise_has_the_asked_standard_deviation():
    sigma = 0.3
    X_WB = X_WB_at(0.0)
    noiseless = camera()
    exact = noiseless.find_marks(looking_from(noiseless, X_WB))
    system = camera(pixel_noise=sigma, seed=5)
    context = looking_from(system, X_WB)
    noise = []
    for number in range(500):
        context.SetTime(number / RATE)
        noise.append(system.find_marks(context) - exact)
    assert np.std(noise) == pytest.approx(sigma, rel=NOISE_SHARE)
    assert abs(np.mean(noise)) < NOISE_SHARE * sigma
    # Corners and coordinates do not move together.
    correlation = np.corrcoef(np.reshape(noise, (500, 8)).T) - np.eye(8)
    assert np.max(np.abs(correlation)) < 4.0 / np.sqrt(500)


def test_an_auto_focus_zooms_about_the_principal_point():
    share, period = 0.05, 2.0
    plain, zooming = camera(), camera(focus=(share, period))
    ports = {"X_WP": X_WB_at(0.0), "X_WO": X_WO}
    middle = np.array([PINHOLE.cx, PINHOLE.cy])
    still = plain.project(ports.__getitem__, 0.3).reshape(-1, 2) - middle
    for time, zoom in ((0.0, 1.0), (0.5, 1.05), (1.0, 1.0), (1.5, 0.95)):
        seen = zooming.project(ports.__getitem__, time).reshape(-1, 2) - middle
        np.testing.assert_allclose(seen, zoom * still, atol=ROUND_OFF)


def test_noise_depends_on_seed_and_image_only():
    def image(seed, number):
        system = camera(pixel_noise=0.3, seed=seed)
        context = looking_from(system, X_WB_at(0.0))
        context.SetTime(number / RATE)
        return system.find_marks(context)

    np.testing.assert_array_equal(image(1, 7), image(1, 7))
    assert not np.any(image(1, 7) == image(2, 7))
    assert not np.any(image(1, 7) == image(1, 8))
    assert not np.any(image(0, 1) == image(1, 0))
    again = camera(pixel_noise=0.3, seed=1)  # one that takes images anew, and in any order
    context = looking_from(again, X_WB_at(0.0))
    for number in (7, 8, 7, 40, 8, 8, 3):
        context.SetTime(number / RATE)
        np.testing.assert_array_equal(again.find_marks(context), image(1, number))


def test_a_run_can_be_continued_from_a_copy_of_its_context():
    system = camera(pixel_noise=0.3, seed=9)
    simulator = Simulator(system, looking_from(system, X_WB_at(0.0)))
    simulator.AdvanceTo(0.1)
    other = Simulator(system, simulator.get_context().Clone())
    ends = []
    for one in (simulator, other):
        one.AdvanceTo(0.3)
        ends.append(system.GetOutputPort("corners").Eval(one.get_context()))
    np.testing.assert_array_equal(ends[0], ends[1])


OVER_THE_TAG = pose_from_angles(np.array([0.0, 0.0, 0.5]), np.zeros(3))

UNSEEN = {
    "beside the image": (RigidTransform([0.5, 0.0, 0.5]), X_WO),
    "half outside": (RigidTransform([0.33, 0.0, 0.5]), X_WO),
    "behind the camera": (RigidTransform([0.0, 0.0, -0.5]), X_WO),
    "camera in the tag's plane": (RigidTransform([-0.2, 0.0, 0.03]), RigidTransform()),
    "turned away": (
        OVER_THE_TAG,
        pose_from_angles(np.zeros(3), np.array([np.pi, 0.0, 0.0])),
    ),
}


@pytest.mark.parametrize("case", UNSEEN)
def test_a_tag_out_of_sight_is_not_found(case):
    X_WB, tag_pose = UNSEEN[case]
    system = camera(pixel_noise=0.1)
    simulator = Simulator(system, looking_from(system, X_WB, tag_pose))
    simulator.AdvancePendingEvents()
    context = simulator.get_context()
    assert system.find_marks(context) is None
    assert system.GetOutputPort("found").Eval(context) == 0.0
    np.testing.assert_array_equal(system.GetOutputPort("corners").Eval(context), np.zeros(8))
    assert system.GetOutputPort("X_CO").Eval(context).IsExactlyIdentity()


def test_a_tag_that_comes_back_is_found_again():
    system = camera()
    simulator = Simulator(system, looking_from(system, OVER_THE_TAG))
    context = simulator.get_mutable_context()
    found = []
    for number, X_WB in enumerate((OVER_THE_TAG, RigidTransform([2.0, 0.0, 0.5]), OVER_THE_TAG)):
        system.GetInputPort("X_WP").FixValue(context, Value(X_WB))
        simulator.AdvanceTo((number + 0.5) / RATE)
        found.append(system.GetOutputPort("found").Eval(context)[0])
    assert found == [1.0, 0.0, 1.0]


def test_a_knocked_camera_sees_as_one_that_is_mounted_so():
    """A fault of kind off, with an offset and angles, is another mounting in its span."""
    offset, angles = np.array([0.02, -0.01, 0.015]), np.array([1.0, -0.5, 2.0])
    knock = CameraFault(kind="off", start=0.0, duration=1.0, offset=offset, angles_deg=angles)
    X_off = pose_from_angles(offset, np.radians(angles))
    mounted = ProjectedCamera(
        TagTarget(0, SIZE), CameraMounting(X_BC @ X_off.inverse()), PINHOLE, RATE
    )
    for time in (0.5, 1.0):  # in its span, and after that
        other = mounted if time < 1.0 else camera()
        seen, expected = (
            one.image({"X_WP": X_WB_at(0.5), "X_WO": X_WO}.get, time, np.zeros(1))
            for one in (camera(fault=knock), other)
        )
        np.testing.assert_allclose(seen, expected, atol=ROUND_OFF)


def test_a_target_that_is_left_open_is_named_before_the_first_image():
    block = camera()
    context = block.CreateDefaultContext()
    block.GetInputPort("X_WP").FixValue(context, Value(X_WO))
    with pytest.raises(CdprError, match=r"found nothing at its input X_WO; accepted: all of X_WP"):
        Simulator(block, context).Initialize()
