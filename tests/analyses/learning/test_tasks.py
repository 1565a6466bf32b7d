"""What tasks ask for can be done, and rewards say so; loads and references against closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.multibody.tree import SpatialInertia, UnitInertia

from cdpr_drake.analyses.learning.loaded_platform import loaded_robot
from cdpr_drake.analyses.learning.robot_task import MEMBERS_KEPT
from cdpr_drake.analyses.learning.task_kernel import LENGTH, SPEED, write_turn
from cdpr_drake.analyses.learning.task_table import make_task
from cdpr_drake.geometry.poses import exponential, logarithm, pose_row
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_loader import load_robot

ROUNDING = 1e-12
"""Of a few operations on numbers near 1."""

STEP = 1e-5
"""Of central differences [s]; what they leave is `SLOPE`."""

SLOPE = 1e-6


def begun(name, count=4, seed=0, **options):
    task = make_task(name, count, threads=1, **options)
    task.begin(range(count), [np.random.default_rng(seed + k) for k in range(count)])
    return task


def to_goal(task, at, gain=3.0):
    """Twists, over full speed, that lead to the place and turn that an observation has at `at`."""
    o = task.observations().astype(float)
    v = gain * o[:, at : at + 3] * task.scales[LENGTH] / task.scales[SPEED]
    return np.hstack([np.zeros((task.count, 3)), v])


def test_a_twist_towards_the_goal_reaches_it_and_is_worth_more_than_standing_still():
    task, still = begun("Reach", action="twist"), begun("Reach", action="twist")
    gained = stood = 0.0
    for _ in range(task.steps):
        task.step(to_goal(task, 20))
        still.step(np.zeros((4, 6)))
        gained, stood = gained + task.rewards, stood + still.rewards
    assert task.infos()["success"].all()
    assert np.all(gained > stood)
    assert np.all(task.rewards > 0.5)


def test_a_twist_towards_the_reference_follows_it():
    task = begun("Track", action="twist")
    far = 0.0
    for _ in range(task.steps):
        aim = to_goal(task, 20)
        aim[:, 3:] += task.motions()[1] / task.scales[SPEED]
        task.step(aim)
        far = np.maximum(far, task.infos()["distance"])
    assert np.all(far < 0.1 * task.reach)


def test_velocity_and_acceleration_of_a_reference_are_its_slopes():
    task = begun("Track", count=1, action="twist", period=STEP)
    for _ in range(3):
        task.step(np.zeros((1, 6)))
    motions = []
    for _ in range(3):
        motions.append(np.array(task.motions())[:, 0])
        task.step(np.zeros((1, 6)))
    slopes = (motions[2] - motions[0]) / (2.0 * STEP)
    assert slopes[:2] == pytest.approx(motions[1][1:], abs=SLOPE)


@pytest.mark.parametrize("robot", ["acrobot_small", "caroca", "planar"])
def test_the_tag_is_seen_from_where_episodes_begin(robot):
    task = begun("VisualServo", count=12, robot=robot)
    assert task.infos()["found"].all()


def test_moving_the_camera_over_the_tag_brings_features_to_where_they_shall_be():
    """By the mean of the points alone, which a shift of the camera moves: s' = -v / Z."""
    task = begun("VisualServo", pixel_noise=0.0)
    R = task._X_PC.rotation().matrix()
    for _ in range(task.steps):
        o = task.observations().astype(float)
        error = o[:, 8:16].reshape(-1, 2, 4)
        size = np.sqrt(np.mean(o[:, :8].reshape(-1, 2, 4).var(axis=2), axis=1))
        forward = 0.5 * (np.sqrt(0.5 * 0.1**2 * 2.0) / size - 1.0)  # the edge over the depth is 0.2
        v_C = np.column_stack([*(5.0 * error.mean(axis=2).T), 5.0 * forward])
        v = v_C @ R.T * task.reach / task.scales[SPEED]
        task.step(np.hstack([np.zeros((4, 3)), 2.0 * v]))
    assert task.infos()["found"].all()
    assert task.infos()["success"].all()


def test_a_cube_is_taken_carried_and_set_down():
    task = begun("PickAndPlace", turn_deg=0.0)
    was_held = np.zeros(4, bool)
    alone = task.robot.platform.mass
    for _ in range(task.steps):
        info = task.infos()
        held, stands = info["held"], info["success"]
        was_held |= held
        aim = to_goal(task, 20)
        carry = to_goal(task, 23)
        aim[held] = carry[held]
        aim[stands] = 0.0
        done = held & (info["goal_distance"] < 0.05 * task.reach)
        near = info["tip_distance"] < 0.05 * task.reach
        close = np.where((held & ~done) | (near & ~stands & ~held), 1.0, -1.0)
        task.step(np.column_stack([aim, close]))
        masses = [one.platform.mass for one in task.batch.robots]
        expected = alone + task.payload * task.infos()["held"]
        assert masses == pytest.approx(expected.tolist(), rel=ROUNDING)
        assert not task.lost.any()
    assert was_held.all()
    assert task.infos()["success"].all()
    assert np.all(task.rewards > 0.9)


def test_a_cube_that_is_let_go_in_the_air_is_lost():
    task = begun("PickAndPlace", count=1)
    for _ in range(200):
        if task.infos()["held"][0]:
            break
        task.step(np.column_stack([to_goal(task, 20), [1.0]]))
    assert task.infos()["held"][0]
    up = np.array([[0, 0, 0, 0, 0, 1.0, 1.0]])
    for _ in range(60):
        task.step(up)
    assert not task.lost[0]
    up[0, 6] = -1.0
    task.step(up)
    assert task.lost[0]
    assert task.rewards[0] < -9.0


def test_momentum_is_kept_when_a_load_is_taken():
    """m v = (m + load) v' of a point mass, whose inertia says nothing else."""
    task = begun("PickAndPlace", count=1, robot="spider_camera", payload=2.0)
    task._to_cube[:] = 0.0  # as if the tip were there
    task.batch.set_twists([0], [0, 0, 0, 0.1, 0.2, -0.1])
    mass = task.robot.platform.mass
    task._take(0)
    expected = np.array([0.1, 0.2, -0.1]) * mass / (mass + 2.0)
    assert task.batch.twists[0, 3:] == pytest.approx(expected, rel=ROUNDING)


def test_a_loaded_platform_is_both_bodies():
    robot = load_robot("acrobot_small")
    p_PL = np.array([0.02, -0.05, -0.1])
    found = platform_inertia(loaded_robot(robot, 0.7, p_PL, 0.04)).CopyToFullMatrix6()
    cube = SpatialInertia.SolidBoxWithMass(0.7, 0.04, 0.04, 0.04).Shift(-p_PL)
    expected = platform_inertia(robot).CopyToFullMatrix6() + cube.CopyToFullMatrix6()
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert isinstance(UnitInertia.SolidCube(0.04), UnitInertia)


def test_turns_are_rotation_vectors():
    random = np.random.default_rng(0)
    for _ in range(50):
        one, other = (exponential(random.normal(size=6)) for _ in range(2))
        out = np.empty(3)
        angle = write_turn(pose_row(one), pose_row(other), out)
        expected = logarithm(one.inverse() @ other)[:3]
        assert out == pytest.approx(expected, abs=1e-9)
        assert angle == pytest.approx(np.linalg.norm(expected), abs=1e-9)


def test_each_episode_has_a_robot_of_its_own():
    task = begun("Reach", randomise={"mass": 0.1, "*.anchor_point.z": 1e-3})
    masses = [one.platform.mass for one in task.batch.robots]
    assert len(set(masses)) == 4
    task.begin([1], [np.random.default_rng(9)])
    again = [one.platform.mass for one in task.batch.robots]
    assert [a == b for a, b in zip(masses, again, strict=True)] == [True, False, True, True]


def test_a_heavy_robot_is_worth_less_by_the_same_tensions():
    """What is drawn acts: with more mass the same tensions let the platform sink."""
    robot = load_robot("acrobot_small")
    heavy = replace(robot, platform=replace(robot.platform, mass=1.5 * robot.platform.mass))
    ends = []
    for one in (robot, heavy):
        task = begun("Reach", count=1, robot=one, action="tensions")
        for _ in range(5):
            task.step(np.full((1, 8), -0.8))
        ends.append(task.batch.poses[0, 6])
    assert ends[1] < ends[0]


def test_robots_of_one_seed_are_made_once_and_few_are_kept():
    """As for those who compare policies; bytes are those of each alone."""
    doubt = {"mass": 0.1, "*.anchor_point.z": 1e-3}
    task = make_task("Track", 3, threads=1, randomise=doubt)
    for first in range(2 * MEMBERS_KEPT):
        seeds = [first, first, 99]
        task.begin(range(3), [np.random.default_rng(seed) for seed in seeds])
        assert task.batch.robots[0] is task.batch.robots[1]
        alone = make_task("Track", 1, threads=1, randomise=doubt)
        for row in (1, 2):
            alone.begin([0], [np.random.default_rng(seeds[row])])
            assert task.observations()[row].tobytes() == alone.observations()[0].tobytes()
            assert task.batch.robots[row].platform.mass == alone.batch.robots[0].platform.mass
    assert len(task._drawn_members) <= 3 * MEMBERS_KEPT
