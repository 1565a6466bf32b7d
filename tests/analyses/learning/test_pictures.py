"""Pictures of environments show the robot as it is, and what its task is about."""

import gymnasium
import numpy as np
import pytest

import cdpr_drake.gym
from cdpr_drake.analyses.learning.robot_picture import HEIGHT, WIDTH, RobotPicture
from cdpr_drake.analyses.learning.task_table import make_task

NAMES = [f"cdpr/{name}-v0" for name in cdpr_drake.gym.STEPS]


def begun(name, **how):
    env = gymnasium.make(name, action="twist", render_mode="rgb_array", **how)
    env.reset(seed=3)
    return env


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_is_of_the_space_and_the_same_each_time(name):
    env = begun(name)
    image = env.render()
    assert (image.shape, image.dtype) == ((HEIGHT, WIDTH, 3), np.uint8)
    np.testing.assert_array_equal(image, env.render())
    np.testing.assert_array_equal(image, begun(name).render())


def test_without_a_mode_there_is_no_picture():
    env = gymnasium.make("cdpr/Reach-v0")
    env.reset(seed=0)
    assert env.unwrapped.render() is None
    envs = gymnasium.make_vec("cdpr/Reach-v0", 2)
    assert envs.unwrapped.render() is None
    assert begun("cdpr/Reach-v0").metadata["render_fps"] == 50  # a picture a step of 0.02 s


def platform_pixel(picture, X_WP):
    """Where the platform's middle is in a picture (u, v), by its camera."""
    uv = picture._pinhole.project((picture._X_WC.inverse() @ X_WP.translation())[:, None])
    return tuple(np.round(uv[:, 0]).astype(int))


def test_platform_and_cables_are_where_they_are():
    """The robot's own geometry, projected by the camera, is of the colours that are drawn."""
    from pydrake.math import RigidTransform

    from cdpr_drake.geometry.poses import pose_from_row

    task = make_task("VisualServo", 2, action="twist")
    task.begin([0, 1], [np.random.default_rng(k) for k in (0, 1)])
    picture = RobotPicture(task)
    images = [picture.draw(row).astype(int) for row in (0, 1)]
    assert not np.array_equal(*images)
    background = images[0][0, 0]
    for row, image in enumerate(images):
        X_WP = pose_from_row(task.batch.poses[row])
        u, v = platform_pixel(picture, X_WP)
        red, _, blue = image[v, u]
        assert blue > 1.5 * red, "the platform is blue"
        exits, anchors = task.robot.cable_set().p_WA, X_WP @ task.robot.cable_set().p_PB
        for start, end in zip(exits.T, anchors.T, strict=True):
            u, v = platform_pixel(picture, RigidTransform(0.5 * (start + end)))
            near = image[v - 2 : v + 3, u - 2 : u + 3]
            assert np.min(np.sum(near, axis=2)) < 0.5 * np.sum(background), "a cable is dark"


def test_many_robots_have_a_picture_each():
    envs = gymnasium.make_vec("cdpr/Reach-v0", 3, action="twist", render_mode="rgb_array")
    envs.reset(seed=3)
    pictures = envs.render()
    assert len(pictures) == 3
    np.testing.assert_array_equal(pictures[0], begun("cdpr/Reach-v0").render())
    assert not np.array_equal(pictures[0], pictures[1])


def test_a_held_cube_moves_with_the_platform():
    task = make_task("PickAndPlace", 1)
    task.begin([0], [np.random.default_rng(0)])
    cube, goal, tip = task.places(0)
    np.testing.assert_array_equal(cube.translation(), task._cubes[0])
    assert np.linalg.norm(tip.translation() - cube.translation()) == pytest.approx(
        task.infos()["tip_distance"][0], abs=task._edge
    )
    task._take(0)
    task.step(np.ones((1, task.action_size)))
    after, same, _ = task.places(0)
    assert np.linalg.norm(after.translation() - cube.translation()) > 1e-4
    assert same.IsExactlyEqualTo(goal)
