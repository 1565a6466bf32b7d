"""Logs of motions that are known in closed form, for tests of identification."""

from dataclasses import replace
from functools import cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import cross_matrix, pose_row, rotation_from_vector
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.regressor import inertia_regressor
from cdpr_drake.identification.samples import sample_motion
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.tensions.control_step_kernel import wrench_matrix_at

ROBOT = load_robot("acrobot_large")
CABLES = ROBOT.cable_set().without_pulleys()
G = np.array([0.0, 0.0, -9.81])
RATE, SPAN, BANDWIDTH = 250.0, 8.0, 8.0
TURNS = np.array([[0.35, 0.20, 0.15], [0.25, -0.30, 0.20], [0.15, 0.25, 0.30]])
WAYS = np.array([[0.08, 0.05, 0.02], [0.06, -0.07, 0.03], [0.05, 0.04, -0.04]])
SPEEDS = np.array([2.6, 4.1, 6.3])


def waves(amplitudes, time, derivative=0):
    """Sums of sines and their derivatives, shape (k, 3)."""
    phase = SPEEDS[:, None] * time[None] + np.arange(3)[:, None] + 0.5 * np.pi * derivative
    return (amplitudes @ (SPEEDS[:, None] ** derivative * np.sin(phase))).T


def motion(time, turn=1.0, move=1.0):
    """Rotations, positions, V and A of a motion R = exp(r(t)), by derivatives of r in closed form
    through Rodrigues' series, differentiated numerically in rotations alone."""
    r = turn * waves(TURNS, time)
    step = 1e-4

    def rotations(at):
        return np.array([rotation_from_vector(v).matrix() for v in turn * waves(TURNS, at)])

    R, after, before = rotations(time), rotations(time + step), rotations(time - step)
    w, alpha = np.empty_like(r), np.empty_like(r)
    R_dot, R_ddot = (after - before) / (2 * step), (after - 2 * R + before) / step**2
    for n in range(len(time)):
        S = R_dot[n] @ R[n].T
        w[n] = [S[2, 1], S[0, 2], S[1, 0]]
        S = R_ddot[n] @ R[n].T - cross_matrix(w[n]) @ cross_matrix(w[n])
        alpha[n] = 0.5 * np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])
    p = np.array([0.0, 0.0, 0.35]) + move * waves(WAYS, time)
    V = np.hstack([w, move * waves(WAYS, time, 1)])
    A = np.hstack([alpha, move * waves(WAYS, time, 2)])
    return R, p, V, A


def believed(**changes):
    """The robot as its file says."""
    platform = rigid_platform(ROBOT)
    m, c = platform.mass, platform.p_PCo
    X = cross_matrix(c)
    I_P = platform.I_PPo + m * X @ X
    law = ROBOT.winch_law().friction
    eight = np.ones(8)
    model = DynamicModel(
        names=tuple(cable.name for cable in ROBOT.cables), mass=m, center_of_mass=c,
        inertia=np.array([I_P[0, 0], I_P[1, 1], I_P[2, 2], I_P[0, 1], I_P[0, 2], I_P[1, 2]]),
        stiffness=ROBOT.stiffness(), retardation=CABLES.retardation, coulomb=law.coulomb * eight,
        static=law.static * eight, viscous=law.viscous * eight,
        stribeck_speed=law.stribeck_speed, offset=0.0 * eight,
    )  # fmt: skip
    return replace(model, **changes)


TRUE = believed(
    mass=4.3,
    center_of_mass=np.array([0.012, -0.008, 0.05]),
    inertia=np.array([0.021, 0.018, 0.024, 0.001, -0.0015, 0.0008]),
)


@cache
def _exact(turn, move, span):
    """Time, rotations, positions and tensions of a motion of the true body; nobody changes them."""
    time = np.arange(0.0, span, 1.0 / RATE)
    R, p, V, A = motion(time, turn, move)
    wrench = inertia_regressor(R, V, A, G) @ TRUE.inertial()
    turns = [_rotation(a) for a in R]
    t, W, packed = np.empty((len(time), 8)), np.empty((6, 8)), CABLES.packed()
    for n, X in enumerate(map(RigidTransform, turns, p)):
        wrench_matrix_at(np.concatenate([pose_row(X), np.zeros(6)]), packed, 0.0, W)
        t[n] = 20.0 + np.linalg.pinv(W) @ (wrench[n] - W @ np.full(8, 20.0))
    return time, turns, p, t


def log(seed=0, *, turn=1.0, move=1.0, tension=0.0, place=0.0, angle=0.0, span=SPAN):
    """Time, pose rows and tensions of a motion of the true body, with noise."""
    random, (time, turns, p, t) = np.random.default_rng(seed), _exact(turn, move, span)
    turned = angle * random.standard_normal((len(time), 3))
    places = p + place * random.standard_normal(p.shape)
    rows = np.array([
        pose_row(RigidTransform(rotation_from_vector(e) @ R, b))
        for e, R, b in zip(turned, turns, places, strict=True)
    ])  # fmt: skip
    return time.copy(), rows, t + tension * random.standard_normal(t.shape)


def _rotation(R):
    return type(rotation_from_vector(np.zeros(3))).ProjectToRotationMatrix(R)


def samples(bandwidth=BANDWIDTH, **how):
    return sample_motion(*log(**how), CABLES, bandwidth)
