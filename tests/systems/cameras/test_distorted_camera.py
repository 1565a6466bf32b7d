"""Cameras with a lens: what they find in images, and what is read of it, rightly or not."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform

from cdpr_drake.analyses.runs.servo import ServoRun
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry.poses import pose_error, pose_from_angles
from cdpr_drake.models.camera_catalogue import CameraFault, load_camera
from cdpr_drake.models.robot_loader import load_robot, robot_file
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.cameras.projected_camera import ProjectedCamera
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.vision.apriltags import TagBundle, TagTarget
from cdpr_drake.vision.dots import DotTarget
from cdpr_drake.vision.lens_distortion import LensDistortion
from cdpr_drake.vision.mark_reading import ellipse_outline, found_marks, outline_moments, read_marks
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.rings import CircleTarget

EXACT = 1e-5
"""Distance [m] and angle [rad] that the iterative pose solver leaves on exact corners."""

PIXEL_TOLERANCE = 1e-9  # [px]; the formulas are OpenCV's
ROUND_TRIP = 1e-8  # [px]; of the lens and back, at slopes of a half
LENS_COST = 1.1
"""Largest ratio of pose errors with a known lens to those without one."""

ELLIPSE_LOSS = 2e-4
"""Of a ring of 0.15 m half a metre away: what moments of an ellipse lose of its image through a
lens, in distance [m]; without the lens it is 1e-9."""

IDEAL = Pinhole(640, 480, 520.0, 505.0, 315.0, 244.0)
BARREL = LensDistortion("brown_conrady", (-0.28, 0.09, 1e-3, -8e-4, -0.01))
FISHEYE = LensDistortion("fisheye", (-0.03, 0.006, -0.002, 1e-4))
LENSES = {"barrel": BARREL, "fisheye": FISHEYE}
SIZE = 0.1
TILTED = pose_from_angles(np.array([0.13, -0.08, 0.5]), np.array([np.pi - 0.3, 0.2, 0.4]))
BARREL_KEYS = "{kind: brown_conrady, k1: -0.25, k2: 0.06, p1: 0.001, p2: -0.0008}"


class NoNoise:
    """For targets that ask for numbers."""

    @staticmethod
    def standard_normal(size):
        return np.zeros(size)


def with_lens(lens, believed=None):
    """The camera with a lens, read as with another one."""
    return replace(IDEAL, distortion=lens, believed=believed)


def images(target, camera, **settings):
    """A camera on a platform whose frame is that of the camera, in front of a target."""
    mounting = CameraMounting(RigidTransform())
    block = ProjectedCamera(target, mounting, camera, 25.0, **settings)

    def of(X_CO, time=0.0, frames=None):
        read = {"X_WP": X_CO.inverse(), "X_WO": RigidTransform()}.__getitem__
        before = block.no_frames() if frames is None else frames
        return block.next_frames(before, block.image(read, time, before))

    return block, of


def by_opencv(camera, p_C):
    """Pixels of OpenCV of points in the camera, shape (2, n)."""
    points, zero = p_C.T.reshape(-1, 1, 3), np.zeros(3)
    k = np.array(camera.distortion.coefficients)
    project = cv2.fisheye.projectPoints if camera.distortion.kind == "fisheye" else None
    if project is not None:
        return project(points, zero, zero, camera.matrix(), k)[0].reshape(-1, 2).T
    return cv2.projectPoints(points, zero, zero, camera.matrix(), k)[0].reshape(-1, 2).T


@pytest.mark.parametrize("name", LENSES)
def test_corners_are_where_opencv_projects_them(name):
    camera, target = with_lens(LENSES[name]), TagTarget(0, SIZE)
    marks = target.project(TILTED, camera, 0.0, NoNoise)
    uv = by_opencv(camera, TILTED @ target.points)
    np.testing.assert_allclose(marks.reshape(-1, 2).T, uv, rtol=0.0, atol=PIXEL_TOLERANCE)


@pytest.mark.parametrize("name", LENSES)
@pytest.mark.parametrize(
    "target",
    [
        TagTarget(0, SIZE), DotTarget(0.08),
        TagBundle([1, 2], [0.06, 0.06], [RigidTransform(), RigidTransform([0.1, 0.0, 0.0])]),
    ],
    ids=["tag", "dots", "bundle"],
)  # fmt: skip
def test_a_known_lens_costs_no_accuracy_without_noise(name, target):
    camera = with_lens(LENSES[name])
    block, of = images(target, camera)
    frames = of(TILTED)
    assert frames[0] == 1.0
    distance, angle = pose_error(block.pose_of(frames), TILTED)
    assert distance < EXACT
    assert angle < EXACT
    ideal = IDEAL.project(TILTED @ target.points).T.ravel()
    np.testing.assert_allclose(block.marks_of(frames), ideal, rtol=0.0, atol=ROUND_TRIP)


@pytest.mark.parametrize("name", LENSES)
def test_an_ignored_lens_shows(name):
    camera = with_lens(LENSES[name], believed=IDEAL)
    block, of = images(TagTarget(0, SIZE), camera)
    assert pose_error(block.pose_of(of(TILTED)), TILTED)[0] > 0.01


def test_other_intrinsic_parameters_are_read_as_they_are_believed():
    """A focal length that is taken for one hundredth longer puts things one hundredth farther."""
    longer = replace(IDEAL, fx=1.01 * IDEAL.fx, fy=1.01 * IDEAL.fy)
    block, of = images(TagTarget(0, SIZE), with_lens(None, believed=longer))
    facing = pose_from_angles(np.array([0.02, 0.01, 0.5]), np.array([np.pi, 0.0, 0.0]))
    place = block.pose_of(of(facing)).translation()
    np.testing.assert_allclose(place, [0.02, 0.01, 0.505], rtol=0.0, atol=EXACT)


@pytest.mark.parametrize("name", LENSES)
def test_noise_costs_with_a_known_lens_what_it_does_without(name):
    """Poses all over the image: a known lens only makes pixels at the rim a little smaller."""
    target, random = TagTarget(0, SIZE), np.random.default_rng(4)
    places = [
        pose_from_angles(
            np.array([*random.uniform(-0.16, 0.16, 2), random.uniform(0.4, 0.6)]),
            np.array([np.pi + 0.3, 0.2, 0.0]) * [1, random.choice([-1, 1]), 1],
        )
        for _ in range(100)
    ]
    errors = []
    for camera in (IDEAL, with_lens(LENSES[name])):
        block, of = images(target, camera, pixel_noise=0.1, seed=1)
        poses = [block.pose_of(of(X, k / 25.0)) for k, X in enumerate(places)]
        found = [pose_error(pose, X) for pose, X in zip(poses, places, strict=True)]
        errors.append(np.sqrt(np.mean(np.square(found), axis=0)))
    assert np.all(errors[1] / errors[0] < LENS_COST)
    assert np.all(errors[1] > 0.0)


def test_what_is_in_view_is_told_by_the_distorted_image():
    """A barrel lens pulls in what a pinhole would not have in its image."""
    target, barrel = TagTarget(0, SIZE), with_lens(BARREL)
    out = pose_from_angles(np.array([0.275, 0.0, 0.5]), np.array([np.pi, 0.0, 0.0]))
    assert not target.in_view(out, IDEAL)
    assert target.in_view(out, barrel)
    pincushion = with_lens(LensDistortion("brown_conrady", (0.3,)))
    rim = pose_from_angles(np.array([0.24, 0.0, 0.5]), np.array([np.pi, 0.0, 0.0]))
    assert target.in_view(rim, IDEAL)
    assert not target.in_view(rim, pincushion)
    away = pose_from_angles(np.array([0.0, 0.0, 0.5]), np.array([0.0, 0.0, 0.0]))
    assert not target.in_view(away, barrel)


@pytest.mark.parametrize("name", LENSES)
def test_a_ring_is_found_through_a_lens(name):
    block, of = images(CircleTarget(0.15), with_lens(LENSES[name]))
    found = block.pose_of(of(TILTED))
    distance = np.linalg.norm(found.translation() - TILTED.translation())
    assert distance < ELLIPSE_LOSS
    axes = found.rotation().matrix()[:, 2] @ TILTED.rotation().matrix()[:, 2]
    assert np.arccos(min(axes, 1.0)) < 0.01


def test_moments_of_an_outline_are_those_of_its_ellipse():
    ellipse = np.array([210.0, 95.0, 400.0, 130.0, 250.0])
    np.testing.assert_allclose(outline_moments(ellipse_outline(ellipse)), ellipse, rtol=1e-12)


def test_marks_are_found_where_they_were_read():
    camera = with_lens(BARREL)
    marks = np.array([100.0, 80.0, 150.0, 90.0, 160.0, 140.0, 95.0, 130.0, 0.5])
    read = read_marks(marks, "corners", 8, camera)
    assert read[8] == 0.5
    back = found_marks(read, "corners", 8, camera)
    np.testing.assert_allclose(back, marks, rtol=0.0, atol=ROUND_TRIP)


def test_a_frozen_camera_with_a_lens_gives_its_last_image_again():
    fault = CameraFault(kind="frozen", start=0.03, duration=1.0)
    bias = np.array([3.0, -2.0])
    _, of = images(TagTarget(0, SIZE), with_lens(BARREL), fault=fault, image_bias=bias)
    first = of(TILTED)
    second = of(RigidTransform([0.0, 0.0, 0.01]) @ TILTED, 0.04, first)
    np.testing.assert_allclose(second, first, rtol=0.0, atol=ROUND_TRIP)


def write_camera(path: Path, **more):
    """A camera's file; keys that are given come on top."""
    own = {
        "name": path.stem, "title": "A camera", "source": "a test", "width": 640, "height": 480,
        "view_angle_horizontal_deg": 63.0, "view_angle_vertical_deg": 50.0, "rate_hz": 30.0,
    }  # fmt: skip
    path.write_text(yaml.safe_dump(own | more), encoding="utf-8")
    return path


def test_a_camera_file_has_principal_point_and_lens(tmp_path):
    path = write_camera(
        tmp_path / "eye.yaml", principal_point=[331.5, 239.0],
        distortion={"kind": "brown_conrady", "k1": -0.1, "p2": 0.002},
    )  # fmt: skip
    pinhole = load_camera(str(path)).pinhole(320, 240)
    assert (pinhole.cx, pinhole.cy) == (165.5, 119.25)
    assert pinhole.distortion == LensDistortion("brown_conrady", (-0.1, 0, 0, 0.002, 0, 0, 0, 0))
    for name in ("astra", "ids_kowa", "mt4018"):
        assert load_camera(name).pinhole(640, 480).is_ideal


def test_robots_and_scenarios_take_camera_files(tmp_path):
    write_camera(tmp_path / "eye.yaml", distortion={"kind": "fisheye", "k1": -0.02})
    robot = load_robot("acrobot_small")
    text = robot_file("acrobot_small").read_text(encoding="utf-8")
    mount = robot.camera_mount("onboard")
    (tmp_path / "mine.yaml").write_text(
        text.replace(f"model: {mount.model}", "model: eye.yaml"), encoding="utf-8"
    )
    mine = load_robot(tmp_path / "mine.yaml")
    assert load_camera(mine.camera_mount("onboard").model).distortion.k1 == -0.02
    asked = [f"camera.model={tmp_path}/eye.yaml", f"perturbations.camera_model={mount.model}"]
    scenario = load_scenario("acrobot_pbvs", asked)
    assert Path(scenario.camera.model).is_absolute()
    (tmp_path / "mine.yaml").write_text(
        text.replace(f"model: {mount.model}", "model: no_eye.yaml"), encoding="utf-8"
    )
    with pytest.raises(RobotFileError, match=r"no_eye\.yaml"):
        load_robot(tmp_path / "mine.yaml")


LOOP = ("camera.kind=projected", "integration.engine=compiled")


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_ibvs", "acrobot_circles"])
def test_a_loop_without_a_diagram_has_the_numbers_of_its_diagram(name):
    logs = [
        ServoRun(
            load_scenario(name, [
                *LOOP, f"integration.loop={loop}", "duration=0.4", "camera.latency_frames=1",
                f"camera.distortion={BARREL_KEYS}", "perturbations.camera_model=astra",
                "perturbations.image_bias=[1, -2]",
            ])
        ).simulate().log
        for loop in ("diagram", "compiled")
    ]  # fmt: skip
    for key, values in logs[0].items():
        # Quaternions are computed from matrices by another kernel than Drake's.
        np.testing.assert_allclose(logs[1][key], values, rtol=0.0, atol=1e-15, err_msg=key)


@pytest.mark.parametrize("name", ["acrobot_pbvs", "acrobot_ibvs"])
def test_a_servo_ends_with_a_known_lens_where_it_does_without(name):
    """And elsewhere where the lens is ignored."""
    ends = []
    for lens in ([], [f"camera.distortion={BARREL_KEYS}"],
                 [f"camera.distortion={BARREL_KEYS}",
                  "perturbations.camera_distortion={kind: none}"]):  # fmt: skip
        result = ServoRun(
            load_scenario(name, [*LOOP, "integration.loop=compiled", *lens])
        ).simulate()
        X_WP = result.log["X_WP"][-1]
        ends.append(float(np.linalg.norm(
            X_WP[4:] - result.built.desired_platform_pose().translation()
        )))  # fmt: skip
    ideal, known, ignored = ends
    assert known < LENS_COST * ideal
    assert ignored > 5.0 * ideal
