"""Exact motions of platforms that hang on any number of cables whose tensions are given."""

from dataclasses import replace
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import cross_matrix
from cdpr_drake.geometry.rotation_kernel import rotations_of_quaternions
from cdpr_drake.identification.parameters import DynamicModel
from cdpr_drake.identification.regressor import symmetric
from cdpr_drake.tensions.control_step_kernel import wrench_matrix_at

G = np.array([0.0, 0.0, -9.81])
RATE, SPAN = 250.0, 8.0
NOISE = {"tension": 0.3, "place": 1e-4, "angle": 2e-4}
CASES = (3, 4, 6, 8, "planar")
"""Numbers of cables about a platform, and four in a vertical plane, in which it moves."""

SWING = 0.05
"""Amplitude of tensions over their mean."""


def body(case):
    """The platform: 13 kg, its centre below the anchor points; symmetric about the plane."""
    planar = case == "planar"
    m = 4 if planar else case
    ones = np.ones(m)
    return DynamicModel(
        names=tuple(f"C{i + 1}" for i in range(m)), mass=13.0,
        center_of_mass=np.array([0.01, 0.0 if planar else -0.015, 0.02]),
        inertia=np.array([0.18, 0.14, 0.2, 0.0, 0.005, 0.0])
        + (0.0 if planar else np.array([0.0, 0.0, 0.0, 0.004, 0.0, -0.003])),
        stiffness=1e5 * ones, retardation=0.0 * ones, coulomb=0.0 * ones, static=0.0 * ones,
        viscous=0.0 * ones, stribeck_speed=1.0, offset=0.0 * ones,
    )  # fmt: skip


def cables(case):
    """Exit points on a ring above a smaller ring of anchor points, or on two bars in a plane."""
    if case == "planar":
        exits = np.array([[-1.5, -1.0, 1.0, 1.5], [0.0] * 4, [1.8] * 4])
        anchors = np.array([[-0.25, -0.1, 0.1, 0.25], [0.0] * 4, [0.2, 0.3, 0.3, 0.2]])
    else:
        angle = 2.0 * np.pi * np.arange(case) / case
        exits = np.array([1.4 * np.cos(angle), 1.4 * np.sin(angle), np.full(case, 1.8)])
        turned = angle + 0.5 * (-1.0) ** np.arange(case) * (case > 3)
        anchors = np.array([0.25 * np.cos(turned), 0.25 * np.sin(turned), np.full(case, 0.25)])
    return CableSet.make(exits, anchors, np.full(exits.shape[1], 1e5))


def given_tensions(case, time):
    """Equal ones that carry the weight at the start, each with waves of its own, shape (k, m)."""
    packed, model = cables(case), body(case)
    m = packed.count
    W = np.empty((6, m))
    wrench_matrix_at(np.array([1.0] + 12 * [0.0]), packed.packed(), 0.0, W)
    even = np.full(m, model.mass * 9.81 / np.sum(W[5]))
    i = np.arange(m)
    slow = np.sin(2.1 * time[:, None] + 1.3 * i) - np.sin(1.3 * i)
    fast = np.sin(4.7 * time[:, None] + 2.9 * i) - np.sin(2.9 * i)
    return even * (1.0 + SWING * (slow + 0.6 * fast) * np.minimum(time[:, None], 1.0))


@cache
def motion(case, span=SPAN):
    """Time, pose rows and tensions without noise, by Newton and Euler."""
    packed, model = cables(case).packed(), body(case)
    mass, I_P = model.mass, symmetric(model.inertial()[4:])
    h = mass * model.center_of_mass
    M = np.block([[I_P, cross_matrix(h)], [-cross_matrix(h), mass * np.eye(3)]])
    back, W = np.linalg.inv(M), np.empty((6, packed.shape[0]))

    def rate(t, x):
        state = np.concatenate([x[:4] / np.linalg.norm(x[:4]), x[4:]])
        R = rotations_of_quaternions(state[None, :4])[0]
        wrench_matrix_at(state, packed, 0.0, W)
        F = W @ given_tensions(case, np.array([t]))[0]
        w = R.T @ state[7:10]
        bias = np.concatenate([np.cross(w, I_P @ w), np.cross(w, np.cross(w, h))])
        own = back @ (np.concatenate([R.T @ F[:3], R.T @ F[3:]]) - bias)
        q, W_q = state[:4], state[7:10]
        q_dot = 0.5 * np.concatenate([[-W_q @ q[1:]], q[0] * W_q + np.cross(W_q, q[1:])])
        return np.concatenate([q_dot, state[10:], R @ own[:3], R @ own[3:] + G])

    time = np.arange(0.0, span, 1.0 / RATE)
    how = {"method": "DOP853", "t_eval": time, "rtol": 1e-10, "atol": 1e-11, "max_step": 0.1}
    poses = solve_ivp(rate, (0.0, time[-1]), [1.0] + 12 * [0.0], **how).y[:7].T
    poses[:, :4] /= np.linalg.norm(poses[:, :4], axis=1, keepdims=True)
    return time, poses, given_tensions(case, time)


def log(case, seed=0, *, tension=0.0, place=0.0, angle=0.0, span=SPAN):
    """The motion with noise."""
    random = np.random.default_rng([seed, 7])
    time, poses, t = motion(case, span)
    turns = angle * random.standard_normal((len(time), 3))
    poses = moved(poses, turns, place * random.standard_normal((len(time), 3)))
    return time, poses, t + tension * random.standard_normal(t.shape)


def moved(poses, e, d):
    """Poses turned by e [rad] and moved by d [m] in W, shape (k, 3) each."""
    q, v = poses[:, :1], poses[:, 1:4]
    turned = np.hstack([
        q - 0.5 * np.sum(e * v, axis=1, keepdims=True), v + 0.5 * (q * e + np.cross(e, v)),
    ])  # fmt: skip
    turned /= np.linalg.norm(turned, axis=1, keepdims=True)
    return np.hstack([turned, poses[:, 4:] + d])


def believed(case, **changes):
    """Another platform than the true one."""
    wrong = {"mass": 10.0, "center_of_mass": np.zeros(3), "inertia": body(case).inertia}
    return replace(body(case), **{**wrong, **changes})
