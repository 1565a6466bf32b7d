"""What no target makes stable: against the criterion, with targets and cameras drawn at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability import no_stable_target as any_target
from cdpr_drake.stability.criterion import stability_margin
from cdpr_drake.stability.desired_view import FixedError
from cdpr_drake.stability.no_stable_target import stable_target_exists
from cdpr_drake.stability.perturbation_bounds import BASELINE
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import judge_stability
from tests.stability.stability_cases import random_poses
from tests.stability.stability_reference import reference_pi

LARGE = BASELINE.varied(r_A=0.1, r_B=0.06)
"""Errors that exclude some poses of ACROBOT and leave others."""


def unit_poses(count):
    """Random poses with unit quaternions."""
    poses = random_poses(count)
    poses[:, :4] /= np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
    return poses


@pytest.fixture(scope="module")
def robot_cables():
    return load_robot("acrobot_large").cable_set().without_pulleys()


@pytest.fixture(scope="module")
def witness(robot_cables):
    """Poses and a perturbation at each whose eigenvalues were looked at, with the smallest."""
    poses = unit_poses(12)
    R, p = rotations_of_quaternions(poses[:, :4]), poses[:, 4:]
    A, B = robot_cables.p_WA.T, robot_cables.p_PB.T
    error = any_target._drawn(np.random.default_rng(3), LARGE, len(poses), 8)
    nothing = any_target._nothing(len(poses), 8)
    true = np.linalg.pinv(any_target._jacobians(R, p, A, B, nothing))
    error = any_target._steepest(LARGE, R, p, A, B, true=true, at=error)
    least = any_target._smallest(true @ any_target._jacobians(R, p, A, B, error))
    d = np.zeros((len(poses), 18 + 48))
    d[:, :3], d[:, 3:6] = error.turn, error.shift
    d[:, 18:42], d[:, 42:] = error.exits.reshape(-1, 24), error.anchors.reshape(-1, 24)
    return poses, d, least


@pytest.mark.parametrize("scheme", ["pbvs", "2.5d", "ibvs"])
def test_the_criterion_has_these_eigenvalues_whatever_is_seen(robot_cables, witness, scheme):
    rng = np.random.default_rng(1)
    for pose, d, least in zip(*witness, strict=True):
        R = RotationMatrix(rotations_of_quaternions(pose[None, :4])[0])
        X_PC = RigidTransform(R, rng.normal(size=3))
        place = np.append(rng.uniform(-0.4, 0.4, 2), rng.uniform(0.3, 1.0))
        target = FixedError(rng.uniform(-1.5, 1.5, 3), rng.normal(size=3), place, np.eye(3))
        case = StabilityCase(robot_cables, scheme, False, X_PC, target)
        Pi = reference_pi(case, pose, d)
        assert np.linalg.eigvals(Pi).real.min() == pytest.approx(least, abs=1e-8)
        # Lyapunov: the symmetric part is not above the smallest real part.
        assert stability_margin(Pi) <= least + 1e-8


def test_an_excluded_pose_is_not_stable_for_any_verdict_that_looks_hard(robot_cables):
    poses = unit_poses(60)
    possible = stable_target_exists(robot_cables, LARGE, poses)
    assert 0 < possible.sum() < len(poses)
    for scheme in ("pbvs", "ibvs"):
        case = StabilityCase(robot_cables, scheme)
        found = judge_stability(case, LARGE, poses, "searched")
        assert not np.any(found.stable & ~possible)


def test_a_pose_alone_gets_what_it_gets_among_others(robot_cables):
    poses = unit_poses(12)
    some = stable_target_exists(robot_cables, LARGE, poses)
    alone = [stable_target_exists(robot_cables, LARGE, pose)[0] for pose in poses]
    np.testing.assert_array_equal(some, alone)


def test_without_errors_and_with_more_poses_drop_out_only(robot_cables):
    poses = unit_poses(30)
    none = stable_target_exists(robot_cables, BASELINE.scaled(0.0), poses)
    assert none.all()
    few = stable_target_exists(robot_cables, LARGE.scaled(0.5), poses)
    many = stable_target_exists(robot_cables, LARGE, poses)
    assert many.sum() <= few.sum()


def test_every_step_goes_down_and_stays_within_the_bounds(robot_cables):
    poses = unit_poses(6)
    R, p = rotations_of_quaternions(poses[:, :4]), poses[:, 4:]
    A, B = robot_cables.p_WA.T, robot_cables.p_PB.T
    at = any_target._drawn(np.random.default_rng(2), LARGE, len(poses), 8)
    nothing = any_target._nothing(len(poses), 8)
    true = np.linalg.pinv(any_target._jacobians(R, p, A, B, nothing))
    goal = any_target._steepest(LARGE, R, p, A, B, true=true, at=at)
    before = any_target._smallest(true @ any_target._jacobians(R, p, A, B, at))
    for name, radius in (
        ("turn", LARGE.d_theta_bp), ("shift", LARGE.r_bp), ("exits", LARGE.r_A),
        ("anchors", LARGE.r_B),
    ):  # fmt: skip
        step = getattr(goal, name)
        assert np.linalg.norm(step, axis=-1).max() <= radius + 1e-12
        moved = replace(at, **{name: getattr(at, name) + 1e-5 * step})
        after = any_target._smallest(true @ any_target._jacobians(R, p, A, B, moved))
        assert np.all(after < before)
