"""Motion types and gravity through the files of other tools, out and in."""

import ast

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake import formats, models
from cdpr_drake.formats import assumptions
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_error
from cdpr_drake.models.cable_schema import Rail
from cdpr_drake.models.shapes import FrameBeam
from tests.motion.small_robots import small_robot

EXACT = 1e-9
HELD = {
    "caspr": ["pendulum", "tripod", "lift", "level_point", "upright_point", "upright_body",
              "hanging_four"],
    "wcrfx": ["pendulum", "tripod", "lift", "level_point", "beam", "hanging_four"],
    "mjcf": ["pendulum", "tripod", "lift", "slope", "level_point", "upright_point", "upright_body",
             "oblique_body", "tilted_gravity", "hanging_four"],
}  # fmt: skip


@pytest.fixture(autouse=True)
def no_home_search(monkeypatch):
    """What wcrfx lacks, a home pose, is searched for over 225 poses; other tests look at that."""
    monkeypatch.setattr(assumptions, "_farthest", lambda *_: (0, 1.0))


def through(robot, format, folder):
    """The robot as it comes back from a format."""
    for name, text in formats.export_robot(robot, format).items():
        (folder / name).write_text(text, encoding="utf-8")
        path = folder / name
    return formats.import_robot(folder if format == "caspr" else path).robot


@pytest.mark.parametrize(("format", "name"), [(f, n) for f, names in HELD.items() for n in names])
def test_out_and_in(format, name, tmp_path):
    if format == "mjcf":
        pytest.importorskip("mujoco")
    robot = small_robot(name)
    again = through(robot, format, tmp_path)
    one, other = robot.motion_type(), again.motion_type()
    R = robot.home.transform().rotation().matrix()
    np.testing.assert_allclose(
        one.basis(R) @ one.basis(R).T, other.basis(R) @ other.basis(R).T, atol=EXACT
    )
    if format != "wcrfx":  # which has neither a home pose nor gravity
        assert max(pose_error(again.home.transform(), robot.home.transform())) < EXACT
        np.testing.assert_allclose(again.gravity_vector(), robot.gravity_vector(), atol=EXACT)
    X_WP = robot.home.transform()
    np.testing.assert_allclose(
        cable_paths(X_WP, again.cable_set()).lengths,
        cable_paths(X_WP, robot.cable_set()).lengths,
        atol=EXACT,
    )


@pytest.mark.parametrize("format", ["caspr", "wcrfx", "gazebo-yaml", "urdf", "sdf", "sdf-drake"])
def test_the_world_is_turned_for_formats_with_gravity_along_z(format, tmp_path):
    """The file says by which rotation; turned back, the robot is the one that was written."""
    robot = small_robot("tilted_gravity")
    said = formats.export_omissions(robot, format)["gravity_direction"]
    assert said.startswith(f"The world was turned by 19.827 deg: {format} has gravity along -z")
    texts = formats.export_robot(robot, format).values()
    assert all(said.removesuffix(".") in text for text in texts)
    rows = said.partition("R_UW by rows ")[2].removesuffix(".")
    R_UW = np.array(ast.literal_eval(f"[{rows}]"))
    np.testing.assert_allclose(R_UW @ robot.down(), [0.0, 0.0, -1.0], atol=EXACT)
    np.testing.assert_allclose(R_UW @ R_UW.T, np.eye(3), atol=EXACT)
    again = through(robot, format, tmp_path)
    assert again.down() == (0.0, 0.0, -1.0)
    np.testing.assert_allclose(again.exit_points(), R_UW @ robot.exit_points(), atol=EXACT)
    X_WP, turn = robot.home.transform(), RigidTransform(RotationMatrix(R_UW), np.zeros(3))
    np.testing.assert_allclose(
        cable_paths(turn @ X_WP, again.cable_set().without_pulleys()).lengths,
        cable_paths(X_WP, robot.cable_set().without_pulleys()).lengths,
        atol=EXACT,
    )
    if format != "wcrfx":  # which has no home pose
        assert max(pose_error(again.home.transform(), turn @ X_WP)) < EXACT


def test_a_world_with_gravity_along_z_is_not_turned():
    assert all(
        "turned" not in words
        for words in formats.export_omissions(small_robot("tripod"), "caspr").values()
    )
    assert models.world_turn(small_robot("tilted_gravity"), "mjcf") == ""
    assert models.gravity_turn(small_robot("tilted_gravity", gravity=0.0)) is None


def test_turned_upside_down_and_back():
    """All of a robot turns: points, axes, rails, beams, cameras of the world, home and frame."""
    robot = small_robot("hanging_four", gravity_direction=[0.0, 0.0, 1.0])
    robot.cables[0].swivel_axis = np.array([0.6, 0.0, 0.8])
    robot.cables[1].rail = Rail(axis=np.array([1.0, 2.0, 0.0]), lower=-1.0, upper=1.0, at=0.3)
    robot.frame.beams = [FrameBeam(start=np.array([-2.0, 0, 0]), end=np.array([2.0, 0, 1.0]))]
    camera = models.Pose(position=np.array([1.0, 0.5, 0.2]), angles_deg=np.array([10.0, 20, 30]))
    robot.cameras = [models.CameraMount(name="c", model="astra", parent="world", pose=camera)]
    turn = models.gravity_turn(robot)
    upright = models.turned_robot(robot, turn)
    assert upright.down() == (0.0, 0.0, -1.0)
    again = models.turned_robot(upright, turn.inverse())
    for one, other in ((robot, upright), (robot, again)):
        R = turn.matrix() if other is upright else np.eye(3)
        X = RigidTransform(RotationMatrix(R), np.zeros(3))
        a, b = one.cable_set(), other.cable_set()
        np.testing.assert_allclose(b.p_WA, R @ a.p_WA, atol=EXACT)
        np.testing.assert_allclose(b.swivel_axis, R @ a.swivel_axis, atol=EXACT)
        np.testing.assert_allclose(other.cables[1].rail.axis, R @ one.cables[1].rail.axis)
        beam, was = other.frame.beams[0], one.frame.beams[0]
        np.testing.assert_allclose(beam.end - beam.start, R @ (was.end - was.start), atol=EXACT)
        for pose, old in ((other.home, one.home), (other.cameras[0].pose, one.cameras[0].pose)):
            assert max(pose_error(pose.transform(), X @ old.transform())) < EXACT
        np.testing.assert_allclose(other.frame.upper - other.frame.lower, [4.0, 4.0, 4.0])
        np.testing.assert_allclose(other.gravity_vector(), R @ one.gravity_vector(), atol=EXACT)


@pytest.mark.parametrize("name", ["tripod", "upright_point", "oblique_body", "tilted_gravity"])
def test_mujoco_has_the_same_accelerations(name):
    """Falling, without its cables."""
    mujoco = pytest.importorskip("mujoco")
    robot, velocity = small_robot(name), np.zeros(6)
    (text,) = formats.export_robot(robot, "mjcf").values()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    model.tendon_stiffness[:] = 0.0
    mujoco.mj_forward(model, data)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "platform")
    data.qvel[:] = data.qacc
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
    X_WP, platform = robot.home.transform(), models.rigid_platform(robot)
    B = robot.motion_type().basis(X_WP.rotation().matrix())
    M = B.T @ platform.mass_matrix(X_WP) @ B
    expected = B @ np.linalg.solve(M, B.T @ platform.weight_wrench(X_WP))
    np.testing.assert_allclose(velocity, expected, rtol=0, atol=1e-8)
