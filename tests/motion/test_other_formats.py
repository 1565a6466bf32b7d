"""Motion types and gravity through the files of other tools, out and in."""

import numpy as np
import pytest

from cdpr_drake import models
from cdpr_drake.errors import RobotFileError
from cdpr_drake.geometry import cable_paths
from cdpr_drake.spatial import pose_error
from tests.motion.small_robots import small_robot

EXACT = 1e-9
HELD = {
    "caspr": ["pendulum", "tripod", "lift", "level_point", "upright_point", "upright_body",
              "hanging_four"],
    "wcrfx": ["pendulum", "tripod", "lift", "level_point", "beam", "hanging_four"],
    "mjcf": ["pendulum", "tripod", "lift", "slope", "level_point", "upright_point", "upright_body",
             "oblique_body", "tilted_gravity", "hanging_four"],
}  # fmt: skip
REFUSED = [
    ("caspr", "slope", "motions are along axes of W"),
    ("caspr", "beam", "motions are along axes of W"),
    ("caspr", "tilted_gravity", "gravity_direction: found"),
    ("wcrfx", "upright_body", "or with it along z"),
    ("mjcf", "beam", "all types but 2R3T"),
    ("sdf", "tripod", "accepted for sdf: 3R3T"),
    ("urdf", "tilted_gravity", "accepted for urdf: along -z of W"),
]


def through(robot, format, folder):
    """The robot as it comes back from a format."""
    for name, text in models.write_robot(robot, format).items():
        (folder / name).write_text(text, encoding="utf-8")
        path = folder / name
    return models.import_robot(folder if format == "caspr" else path).robot


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


@pytest.mark.parametrize(("format", "name", "words"), REFUSED)
def test_what_a_format_cannot_hold_is_refused_by_name(format, name, words):
    with pytest.raises(RobotFileError, match=words):
        models.write_robot(small_robot(name), format)


@pytest.mark.parametrize("name", ["tripod", "upright_point", "oblique_body", "tilted_gravity"])
def test_mujoco_has_the_same_accelerations(name, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    robot = small_robot(name)
    (text,) = models.write_robot(robot, "mjcf").values()
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    model.tendon_stiffness[:] = 0.0  # falling, without its cables
    mujoco.mj_forward(model, data)
    g = robot.gravity_vector()
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "platform")
    velocity = np.zeros(6)
    data.qvel[:] = data.qacc
    mujoco.mj_fwdVelocity(model, data)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, velocity, 0)
    B = robot.motion_type().basis(robot.home.transform().rotation().matrix())
    platform = models.rigid_platform(robot)
    X_WP = robot.home.transform()
    M = B.T @ platform.mass_matrix(X_WP) @ B
    expected = B @ np.linalg.solve(M, B.T @ platform.weight_wrench(X_WP))
    np.testing.assert_allclose(velocity, expected, atol=1e-9 * np.linalg.norm(g))
