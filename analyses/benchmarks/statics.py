"""Benchmarks of forward models: poses from lengths, cables at a pose, poses of rest, stiffness."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from pydrake.math import RigidTransform
from scipy.optimize import least_squares, leastsq

from cdpr_drake.analyses.reporting.timing import TimingRow, interleaved, seconds_per_call
from cdpr_drake.arrays import Array
from cdpr_drake.cables.dispatch_kernel import HANGING, STRAIGHT, all_responses
from cdpr_drake.cables.models import CATENARY, ELASTIC, cable_state
from cdpr_drake.cables.response_kernel import DERIVATIVES
from cdpr_drake.geometry.cable_paths import motion_of
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.motion_kernel import floating_motion
from cdpr_drake.geometry.motion_type import FREE
from cdpr_drake.geometry.poses import (
    pose_from_angles,
    pose_from_row,
    pose_row,
    rotation_from_vector,
)
from cdpr_drake.geometry.pulley_kernel import pulley_jacobian, pulley_line
from cdpr_drake.models.robot_holding import hold_robot
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.statics.equilibrium import equilibrium_near
from cdpr_drake.statics.equilibrium_program import (
    make_equilibrium_program,
    solve_equilibrium_program,
)
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.statics.pose_fit_kernel import WORK_SHAPE, fit_pose
from cdpr_drake.statics.stiffness import platform_stiffness

ROBOT = "acrobot_large"

START_DISTANCE, START_ANGLE = 0.05, np.radians(10.0)
"""How far guesses are from the poses that are sought [m, rad]."""


def physics_rows(quick: bool) -> list[TimingRow]:
    """All rows of this file; `quick` times fewer poses."""
    repeats = 3 if quick else 9
    cables = load_robot(ROBOT).cable_set()
    rows: list[TimingRow] = []
    for each in (cables.without_pulleys(), cables):
        rows += kinematics_rows(each, _starts(each, 20 if quick else 100), repeats)
    rows += cable_rows(repeats)
    rows += rest_rows(3 if quick else 10, repeats)
    return rows


def _starts(cables: CableSet, count: int) -> list[tuple[Array, Array]]:
    """Lengths of seeded poses, and guesses of them."""
    random, fk = np.random.default_rng(0), ForwardKinematics(cables)
    starts = []
    for _ in range(count):
        position = random.uniform([-0.35, -0.35, 0.1], [0.35, 0.35, 0.8])
        X_WP = pose_from_angles(position, random.uniform(-0.2, 0.2, 3))
        p, w = random.normal(size=3), random.normal(size=3)
        p *= START_DISTANCE * np.cbrt(random.uniform()) / np.linalg.norm(p)
        w *= START_ANGLE * np.cbrt(random.uniform()) / np.linalg.norm(w)
        guess = RigidTransform(rotation_from_vector(w) @ X_WP.rotation(), position + p)
        starts.append((fk.lengths(X_WP), pose_row(guess)))
    return starts


@njit(cache=True)
def length_residuals(pose: Array, cables: Array, lengths: Array) -> Array:
    """Lengths at a pose (quaternion, position) less those given, and the quaternion's norm.

    What algorithm 2 of the servoing thesis hands to a least-squares solver, from the kernel that
    `ForwardKinematics` uses.
    """
    m = cables.shape[0]
    state, out = np.zeros(13), np.empty(m + 1)
    state[:7] = pose
    X = floating_motion(state)
    for i in range(m):
        out[i] = pulley_line(X, cables[i])[0] - lengths[i]
    out[m] = pose[0] ** 2 + pose[1] ** 2 + pose[2] ** 2 + pose[3] ** 2 - 1.0
    return out


def _cpu_time(work: Callable[[], object], calls: int) -> float:
    """Mean processor time of `calls` calls [us]: what other programs take does not count."""
    began = time.process_time()
    for _ in range(calls):
        work()
    return 1e6 * (time.process_time() - began) / calls


def _mean(starts: list[Any], call: Callable[..., object]) -> float:
    """Mean processor time of a call over starts [us]."""

    def all_of_them() -> None:
        for start in starts:
            call(start)

    return _cpu_time(all_of_them, 1) / len(starts)


def kinematics_rows(cable_set: CableSet, starts: list[Any], repeats: int) -> list[TimingRow]:
    """One pose from eight lengths, against scipy's solvers on the same residual."""
    fk = ForwardKinematics(cable_set)
    cables, used = cable_set.packed(), np.arange(cable_set.count)
    state, work, free = np.empty(13), np.empty(WORK_SHAPE), FREE.packed()
    poses = [(lengths, pose_from_row(guess)) for lengths, guess in starts]
    many = np.array([lengths for lengths, _ in starts] * 20)
    guesses = np.array([guess for _, guess in starts] * 20)
    kernel, checked, batch, minpack, trf = interleaved(
        [
            lambda: _mean(
                starts, lambda s: fit_pose(s[1], cables, used, s[0], free, 1e-6, state, work)
            ),
            lambda: _mean(poses, lambda s: fk.pose(*s)),
            lambda: 1e6 * seconds_per_call(lambda: fk.poses(many, guesses), 1) / len(many),
            lambda: _mean(starts, lambda s: leastsq(length_residuals, s[1], args=(cables, s[0]))),
            lambda: _mean(
                starts, lambda s: least_squares(length_residuals, s[1], args=(cables, s[0]))
            ),
        ],
        repeats,
    )
    where = ", pulleys" if cable_set.has_pulleys() else ""
    names = [
        (f"pose from lengths{where}: kernel", kernel),
        (f"pose from lengths{where}: with checks", checked),
        (f"pose from lengths{where}: batch", batch),
    ]
    return [
        TimingRow(name, value, "us", other, base, base / value, ratio_means="times faster")
        for name, value in names
        for other, base in (("leastsq, same residual", minpack), ("least_squares, same", trf))
    ] + [
        TimingRow(
            f"ForwardKinematics.pose{where}", checked, "us", "its kernel", kernel,
            checked / kernel, ratio_means="times as long",
        )
    ]  # fmt: skip


def cable_rows(repeats: int) -> list[TimingRow]:
    """Eight cables at one pose: what pulleys cost, and what sag costs."""
    robot = load_robot("caroca")
    with_pulleys = robot.cable_set()
    over, plain = with_pulleys.packed(), with_pulleys.without_pulleys().packed()
    X_WP = robot.home.transform()
    X, m = motion_of(X_WP), with_pulleys.count
    lengths, J = np.empty(m), np.empty((m, 6))
    states, D = np.empty((m, 11)), np.zeros((m, DERIVATIVES, 4))
    l0 = hold_robot(robot, X_WP, with_pulleys, CATENARY).unstrained_lengths
    guesses = np.zeros((m, 2))

    def timed(call: Callable[[], object]) -> Callable[[], float]:
        return lambda: _cpu_time(call, 2000)

    pulley, fixed, sagging, straight = interleaved(
        [
            timed(lambda: pulley_jacobian(X, over, lengths, J)),
            timed(lambda: pulley_jacobian(X, plain, lengths, J)),
            timed(lambda: all_responses(HANGING, X, over, l0, guesses, states, D)),
            timed(lambda: all_responses(STRAIGHT, X, over, l0, guesses, states, D)),
        ],
        repeats,
    )
    longer = "times as long"
    return [
        TimingRow(
            "lengths and Jacobian, pulleys", pulley, "us", "fixed exit points", fixed,
            pulley / fixed, ratio_means=longer,
        ),
        TimingRow(
            "forces and derivatives, catenary", sagging, "us", "straight elastic", straight,
            sagging / straight, ratio_means=longer,
        ),
    ]  # fmt: skip


def rest_rows(count: int, repeats: int) -> list[TimingRow]:
    """Pose of rest against SNOPT on the same energy, stiffness against differences."""
    robot = load_robot(ROBOT)
    cables, platform, home = robot.cable_set(), rigid_platform(robot), robot.home.transform()
    random, fk = np.random.default_rng(0), ForwardKinematics(cables)
    sets = [fk.lengths(home) + random.normal(scale=1e-3, size=cables.count) for _ in range(count)]

    def program(l0: Array) -> RigidTransform:
        return solve_equilibrium_program(
            make_equilibrium_program(cables, ELASTIC, platform, l0, home)
        )

    rest = equilibrium_near(cables, ELASTIC, platform, sets[0], home)

    def differences() -> Array:
        K = np.empty((6, 6))
        for k, d in enumerate(1e-6 * np.eye(6)):
            wrenches = [
                cable_state(cables, ELASTIC, _moved(rest.X_WP, s * d), sets[0]).wrench
                for s in (1.0, -1.0)
            ]
            K[:, k] = (wrenches[1] - wrenches[0]) / 2e-6
        return K

    def exact() -> Array:
        return platform_stiffness(cables, ELASTIC, platform, rest.X_WP, sets[0]).total

    newton, sagging, snopt, stiffness, difference = interleaved(
        [
            lambda: _mean(sets, lambda l0: equilibrium_near(cables, ELASTIC, platform, l0, home)),
            lambda: _mean(sets, lambda l0: equilibrium_near(cables, CATENARY, platform, l0, home)),
            lambda: _mean(sets, program),
            lambda: _cpu_time(exact, 20),
            lambda: _cpu_time(differences, 20),
        ],
        repeats,
    )
    return [
        TimingRow(
            "pose of rest, Newton", newton, "us", "MathematicalProgram, SNOPT", snopt,
            snopt / newton, ratio_means="times faster",
        ),
        TimingRow(
            "pose of rest, catenary", sagging, "us", "straight elastic", newton,
            sagging / newton, ratio_means="times as long",
        ),
        TimingRow(
            "platform_stiffness", stiffness, "us", "central differences", difference,
            difference / stiffness, ratio_means="times faster",
        ),
    ]  # fmt: skip


def _moved(X_WP: RigidTransform, d: Array) -> RigidTransform:
    return RigidTransform(rotation_from_vector(d[:3]) @ X_WP.rotation(), X_WP.translation() + d[3:])
