"""Targets in drawn images, and the detector's block: marks, poses, what is not taken for them."""

from functools import cache

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import PortDataType
from pydrake.systems.sensors import ImageRgba8U

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.servoing.pose_features import seen_pose_error
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.cameras.target_measurement import TargetDetector
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.diagrams.visual_servo import build_visual_servo
from cdpr_drake.vision.apriltags import TagBundle, TagTarget, tag_corners
from cdpr_drake.vision.blob_detection import find_dark_blobs
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.rings import CircleTarget, to_pixels
from cdpr_drake.vision.texture_pictures import drawn_image
from cdpr_drake.vision.textured_target import TexturedTarget

CAMERA = Pinhole.from_view_angles(640, 480, np.radians(60.0), np.radians(46.8))
SIZE = 0.1
FINER = 4
"""Images are drawn this much larger and then averaged, so that edges are smooth."""

CENTER_OFFSET = 0.15
"""Centre of a drawn dot or ring [px], from grey values."""

SIZE_OFFSET = 0.004
"""Share by which a moment of a drawn ring is off: a tenth of a pixel of a radius of 50 px."""

SOLVER = 1e-6
"""Poses from exact marks [m, rad]."""

BUNDLE = TagBundle(
    [3, 8],
    [0.05, 0.04],
    [pose_from_angles(np.array([-0.04, 0.0, 0.0]), np.zeros(3)), RigidTransform([0.04, 0.01, 0.0])],
)
TARGETS = {
    "tag": TagTarget(3, SIZE),
    "dots": DotTarget(SIZE),
    "ring": CircleTarget(SIZE),
    "bundle": BUNDLE,
}

poses = st.builds(
    lambda tilt_x, tilt_y, turn, x, y, z: pose_from_angles(
        z * np.array([x, y, 1.0]), np.array([np.pi + tilt_x, tilt_y, turn])
    ),
    st.floats(-0.7, 0.7),
    st.floats(-0.7, 0.7),
    st.floats(-3.0, 3.0),
    st.floats(-0.12, 0.12),
    st.floats(-0.12, 0.12),
    st.floats(0.4, 0.8),
)


def drawn(target, X_CO):
    """What the camera sees of a target's plates on a grey ground."""
    size = (FINER * CAMERA.width, FINER * CAMERA.height)
    big = np.full(size[::-1], 150, np.uint8)
    for plate in target.plates():
        picture = cv2.imdecode(np.frombuffer(plate.png, np.uint8), cv2.IMREAD_GRAYSCALE)
        n = picture.shape[0]
        source = np.array([[0, 0], [n, 0], [n, n], [0, n]], np.float32) - 0.5
        rim = CAMERA.project(X_CO @ plate.X_OT @ tag_corners(plate.width)).T
        finer = (FINER * rim + (FINER - 1) / 2.0).astype(np.float32)
        warp = cv2.getPerspectiveTransform(source, finer)
        where = cv2.warpPerspective(np.full_like(picture, 255), warp, size)
        cv2.copyTo(cv2.warpPerspective(picture, warp, size, flags=cv2.INTER_LINEAR), where, big)
    gray = cv2.resize(big, (CAMERA.width, CAMERA.height), interpolation=cv2.INTER_AREA)
    return np.repeat(gray[:, :, np.newaxis], 3, axis=2)


def ideal(target, X_CO):
    return target.project(X_CO, CAMERA, 0.0, np.random.default_rng(0))


VIEWS = [
    pose_from_angles(np.array([0.0, 0.0, 0.3]), np.array([np.pi, 0.0, np.pi])),
    pose_from_angles(np.array([0.03, -0.02, 0.38]), np.array([np.pi + 0.3, -0.2, 0.4])),
    pose_from_angles(np.array([-0.05, 0.05, 0.45]), np.array([np.pi - 0.2, 0.35, -2.0])),
]


@cache
def view_of(name, view):
    """A drawn image of a target in one of the views."""
    return drawn(TARGETS[name], VIEWS[view])


@pytest.mark.parametrize("view", range(len(VIEWS)))
def test_dots_are_found_in_order(view):
    """Within the offset that a dot's tilt and radius cause, beside that of the drawing."""
    found = TARGETS["dots"].find(view_of("dots", view))
    offset = found - ideal(TARGETS["dots"], VIEWS[view])
    assert np.max(np.abs(offset)) < (CENTER_OFFSET if view == 0 else 0.6)


def near_views(count):
    """Poses at which the whole plate is in the image, as near and tilted as that allows."""
    random = np.random.default_rng(4)
    while count:
        tilt, place = (
            random.uniform(-0.9, 0.9, 2),
            random.uniform([-0.5, -0.4, 0.15], [0.5, 0.4, 0.5]),
        )
        X_CO = pose_from_angles(
            place[2] * np.array([*place[:2], 1.0]),
            np.array([np.pi + tilt[0], tilt[1], random.uniform(-np.pi, np.pi)]),
        )
        if ideal(TARGETS["dots"], X_CO) is not None:
            count -= 1
            yield X_CO


def test_dots_are_found_wherever_the_plate_is_seen():
    """Also where perspective makes the larger dot smaller in the image than one that is nearer.

    The order is told by marks that are nearer to the right ones than a tenth of the square's edge.
    """
    dots = TARGETS["dots"]
    for X_CO in near_views(25):
        found, exact = dots.find(drawn(dots, X_CO)), ideal(dots, X_CO)
        assert found is not None, X_CO
        apart = np.linalg.norm(np.diff(exact.reshape(4, 2), axis=0), axis=1).min()
        assert np.max(np.abs(found - exact)) < 0.1 * apart, X_CO


@pytest.mark.parametrize("view", range(len(VIEWS)))
def test_rings_are_found_with_their_moments(view):
    found = TARGETS["ring"].find(view_of("ring", view)).reshape(2, 5)
    exact = ideal(TARGETS["ring"], VIEWS[view]).reshape(2, 5)
    np.testing.assert_allclose(found[:, :2], exact[:, :2], atol=CENTER_OFFSET)
    for ours, theirs in zip(found[:, 2:], exact[:, 2:], strict=True):
        np.testing.assert_allclose(ours, theirs, atol=SIZE_OFFSET * (theirs[0] + theirs[2]))


@pytest.mark.parametrize("view", range(len(VIEWS)))
def test_bundles_are_found_tag_by_tag(view):
    found = BUNDLE.find(view_of("bundle", view))
    assert np.max(np.abs(found - ideal(BUNDLE, VIEWS[view]))) < 0.6
    assert pose_error(BUNDLE.solve(found, CAMERA), VIEWS[view])[0] < 2e-3


@pytest.mark.parametrize("name", TARGETS)
def test_no_other_target_is_taken_for_it(name):
    for other in TARGETS:
        if other != name and {name, other} != {"tag", "bundle"}:
            assert TARGETS[name].find(view_of(other, 1)) is None, other


def test_blank_and_cut_pictures_hold_nothing():
    for gray in (0, 128, 255):
        assert find_dark_blobs(np.full((480, 640, 3), gray, np.uint8)) == []
    at_the_rim = pose_from_angles(np.array([0.155, 0.0, 0.3]), np.array([np.pi, 0.0, 0.0]))
    for name in ("dots", "ring"):
        assert TARGETS[name].find(drawn(TARGETS[name], at_the_rim)) is None
        assert ideal(TARGETS[name], at_the_rim) is None


@pytest.mark.parametrize("name", ["tag", "dots", "bundle"])
@settings(max_examples=25)
@given(X_CO=poses)
def test_the_pose_comes_back_from_exact_points(name, X_CO):
    target = TARGETS[name]
    found = target.solve(ideal(target, X_CO), CAMERA)
    assert max(pose_error(X_CO, found)) < SOLVER


@settings(max_examples=60)
@given(X_CO=poses)
def test_the_pose_comes_back_from_exact_circles_but_for_their_rotation(X_CO):
    ring = TARGETS["ring"]
    found = ring.solve(ideal(ring, X_CO), CAMERA)
    assert np.linalg.norm(found.translation() - X_CO.translation()) < SOLVER
    normals = [X.rotation().matrix()[:, 2] for X in (found, X_CO)]
    assert np.linalg.norm(normals[0] - normals[1]) < SOLVER


def test_one_tag_of_a_bundle_is_enough_and_the_other_is_filled_in():
    X_CO = VIEWS[1]
    marks = ideal(BUNDLE, X_CO)
    marks[8:] = np.nan
    found = BUNDLE.solve(marks, CAMERA)
    assert max(pose_error(X_CO, found)) < SOLVER
    np.testing.assert_allclose(
        BUNDLE.complete(marks, found, CAMERA), ideal(BUNDLE, X_CO), atol=1e-3
    )


def test_a_projected_bundle_shows_the_tags_in_view_only():
    X_CO = pose_from_angles(np.array([0.155, 0.0, 0.3]), np.array([np.pi, 0.0, 0.0]))
    marks = ideal(BUNDLE, X_CO)
    assert np.all(np.isfinite(marks[:8]))
    assert np.all(np.isnan(marks[8:]))
    assert BUNDLE.in_view(X_CO, CAMERA)
    assert not BUNDLE.in_view(RigidTransform([0.0, 0.0, 0.3]), CAMERA)  # face down


def test_tags_of_a_bundle_need_not_lie_in_one_plane():
    corner = TagBundle(
        [0, 1],
        [0.05, 0.05],
        [
            RigidTransform(),
            pose_from_angles(np.array([0.05, 0.0, 0.02]), np.array([0.0, 0.6, 0.0])),
        ],
    )
    found = corner.solve(ideal(corner, VIEWS[0]), CAMERA)
    assert max(pose_error(VIEWS[0], found)) < 1e-5


@pytest.mark.parametrize("name", TARGETS)
def test_noise_moves_the_marks_by_as_much(name):
    target, X_CO = TARGETS[name], VIEWS[1]
    random = np.random.default_rng(0)
    marks = np.array([target.project(X_CO, CAMERA, 0.2, random) for _ in range(300)])
    spread = np.std(marks - ideal(target, X_CO), axis=0)
    if name == "ring":  # centres of ellipses from 48 points each
        expected = 0.2 * np.sqrt(2.0 / 48.0)
        assert np.all(np.abs(spread.reshape(2, 5)[:, :2] / expected - 1.0) < 0.4)
    else:
        assert np.all(np.abs(spread / 0.2 - 1.0) < 0.2)


def test_normalized_marks_are_the_ideal_ones():
    for target in TARGETS.values():
        found = target.normalized(ideal(target, VIEWS[1]), CAMERA)
        np.testing.assert_allclose(found, target.ideal_marks(VIEWS[1]), atol=1e-12)
    ring = TARGETS["ring"]
    pixels = to_pixels(ring.ideal_marks(VIEWS[1]), CAMERA)
    np.testing.assert_allclose(pixels.ravel(), ideal(ring, VIEWS[1]), atol=1e-12)


def test_the_centre_of_a_ring_s_image_is_not_the_image_of_its_centre():
    """What (x_o, y_o) needs is the latter."""
    ring, X_CO = TARGETS["ring"], VIEWS[1]
    p = X_CO.translation()
    center = ring.center(ideal(ring, X_CO), X_CO, CAMERA)
    np.testing.assert_allclose(center, p[:2] / p[2], atol=1e-12)
    assert np.linalg.norm(ring.ideal_marks(X_CO)[0, :2] - center) > 1e-3


@given(poses, st.floats(-3.0, 3.0))
def test_a_free_rotation_does_not_count_as_an_error(X_CO, angle):
    turned = RigidTransform(pose_from_angles(np.zeros(3), np.array([0.0, 0.0, angle])) @ X_CO)
    moved = RigidTransform(turned.rotation(), X_CO.translation())
    distance, free = seen_pose_error(moved, X_CO, free_rotation=True)
    assert distance < 1e-12
    assert free < 1e-7
    assert seen_pose_error(moved, X_CO)[1] == pytest.approx(abs(angle), abs=1e-7)


CORNER_OFFSET = 0.5
"""A corner found in a drawn image [px]; OpenCV's refinement leaves a tenth, at times three."""

POSE = 1e-3, np.radians(0.6)
"""Distance [m] and angle of X_CO at 0.4 m: a tenth of a pixel on a tag of 110 px is 0.4 mm."""

RATE = 25.0


def facing(x, y, turn=0.2):
    """X_CO of a tag that nearly faces the camera, 0.4 m before it."""
    return pose_from_angles(np.array([x, y, 0.4]), np.array([np.pi + 0.3, -0.2, turn]))


def picture(pixels, camera=CAMERA):
    image = ImageRgba8U(camera.width, camera.height)
    image.mutable_data[:, :, :3] = pixels
    return Value(image)


class Watching:
    """A detector that a test shows images."""

    def __init__(self, target, latency=0, camera=CAMERA, bias=None):
        self.detector = TargetDetector(target, camera, RATE, latency, bias)
        self.simulator = Simulator(self.detector)
        self.camera, self.shown = camera, 0

    def show(self, pixels):
        """Outputs by name after the next image."""
        context = self.simulator.get_mutable_context()
        port = self.detector.GetInputPort("color_image")
        port.FixValue(context, picture(pixels, self.camera))
        self.simulator.AdvanceTo((self.shown + 0.5) / RATE)
        self.shown += 1
        outputs = [self.detector.get_output_port(i) for i in range(3)]
        return {port.get_name(): port.Eval(context) for port in outputs}


def test_measurements_have_the_ports_of_the_projected_camera():
    target, mounting = TagTarget(0, SIZE), CameraMounting(RigidTransform())
    detector = TargetDetector(target, CAMERA, RATE)
    port = detector.GetInputPort("color_image")
    assert detector.num_input_ports() == 1
    assert isinstance(detector.AllocateInputAbstract(port).get_value(), ImageRgba8U)
    projected = ProjectedCamera(target, mounting, CAMERA, RATE)
    inputs = [projected.get_input_port(i) for i in range(projected.num_input_ports())]
    assert [port.get_name() for port in inputs] == ["X_WP", "X_WO"]
    assert {port.get_data_type() for port in inputs} == {PortDataType.kAbstractValued}
    ports = [
        [
            (port.get_name(), port.get_data_type(), port.size(), type(port.Allocate().get_value()))
            for port in (system.get_output_port(i) for i in range(system.num_output_ports()))
        ]
        for system in (detector, projected)
    ]
    assert ports[0] == ports[1]
    assert [port[::2] for port in ports[0]] == [("corners", 8), ("X_CO", 0), ("found", 1)]


@pytest.mark.parametrize("turn", [0.2, 1.8, -2.7])
def test_a_tag_is_found_with_its_corners_and_pose(turn):
    X_CO, target = facing(0.05, -0.04, turn), TagTarget(11, SIZE)
    seen = Watching(target).show(drawn(target, X_CO))
    assert seen["found"] == 1.0
    offset = seen["corners"].reshape(4, 2).T - CAMERA.project(X_CO @ tag_corners(SIZE))
    assert np.all(np.linalg.norm(offset, axis=0) < CORNER_OFFSET)
    distance, angle = pose_error(X_CO, seen["X_CO"])
    assert distance < POSE[0]
    assert angle < POSE[1]


@pytest.mark.parametrize("case", ["another", "half", "mirrored"])
def test_other_tags_and_half_tags_are_not_found(case):
    tag_id, x = (12 if case == "another" else 11), (0.24 if case == "half" else 0.0)
    pixels = drawn(TagTarget(tag_id, SIZE), facing(x, 0.0))
    seen = Watching(TagTarget(11, SIZE)).show(pixels[:, ::-1] if case == "mirrored" else pixels)
    assert seen["found"][0] == 0.0
    np.testing.assert_array_equal(seen["corners"], np.zeros(8))
    assert seen["X_CO"].IsExactlyIdentity()


@pytest.mark.parametrize("frames", [0, 2])
def test_latency_of_a_detector_delays_by_as_many_periods(frames):
    target = TagTarget(3, SIZE)
    watching, poses = Watching(target, frames), [facing(0.02 * k, 0.0) for k in range(4)]
    for number, X_CO in enumerate(poses):
        seen = watching.show(drawn(target, X_CO))
        assert seen["found"][0] == float(number >= frames)
        if number >= frames:
            assert pose_error(poses[number - frames], seen["X_CO"])[0] < POSE[0]


SMALL = Pinhole.from_view_angles(320, 240, np.radians(60.0), np.radians(46.8))
NEAR = pose_from_angles(np.array([0.0, 0.005, 0.15]), np.array([np.pi, 0.1, 0.3]))

RENDERED_OFFSET = 0.1
"""Of a corner in an image that Drake renders, against its projection [px]; measured up to 0.06 on a
square of 80 px: what it draws is neither averaged over pixels nor as sharp as the picture."""

DRAWN_OFFSET = 0.05
"""The same in an image drawn with averages."""

CHANGES = ["duration=0.2", "integration.engine=compiled", "log_rate=25"]


STONES = TexturedTarget("stones", 0.06)


@pytest.mark.parametrize(("latency", "bias"), [(0, None), (2, np.array([1.5, -2.0]))])
def test_a_texture_is_found_once_by_features_and_then_followed(latency, bias):
    """With what it is measured off and late, too: quality comes with its image."""
    watching, pixels = Watching(STONES, latency, SMALL, bias), drawn_image(STONES, NEAR, SMALL)
    expected = SMALL.project(NEAR @ STONES.points).T + (0.0 if bias is None else bias)
    for image in range(latency + 2):
        seen = watching.show(pixels)
        context = watching.simulator.get_context()
        quality = watching.detector.GetOutputPort("quality").Eval(context)
        assert seen["found"][0] == float(image >= latency)
        if image < latency:
            assert np.all(np.isnan(quality))
            continue
        assert quality[-1] == float(image > latency)
        np.testing.assert_allclose(seen["corners"].reshape(4, 2), expected, atol=DRAWN_OFFSET)


@pytest.mark.parametrize("region", ["whole", "target"])
def test_a_servo_sees_a_texture_in_rendered_images(region):
    """Where the true platform's camera has it, row by row."""
    scenario = load_scenario("acrobot_pbvs_textured", [*CHANGES, f"camera.region={region}"])
    run = ServoRun(scenario).simulate()
    log, servo = run.log, run.built
    seen = np.flatnonzero(log["found"][:, 0])
    assert len(seen) >= len(log["time"]) - 1
    assert log["quality"][seen[0], -1] == 0.0
    assert np.all(log["quality"][seen[1:], -1] == 1.0)
    start = servo.X_CO(scenario.initial_pose.transform(), 0.0)
    exact = servo.pinhole.project(start @ servo.target.points).T.ravel()
    assert np.max(np.abs(log["corners_px"][seen[0]] - exact)) < RENDERED_OFFSET


def test_a_projected_camera_tells_no_quality():
    servo = build_visual_servo(
        load_scenario("acrobot_pbvs_textured", ["camera.kind=projected", "duration=0.1"])
    )
    camera = servo.measurement
    quality = camera.GetOutputPort("quality").Eval(
        camera.GetMyContextFromRoot(servo.make_context())
    )
    assert np.all(np.isnan(quality))
