"""Tensions along paths of the platform: which methods are continuous, and which jump."""

import numpy as np
import pytest

from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.problem import TensionStatus
from tests.tensions.tension_cases import acrobot

RATE = 1000  # [Hz]; of the paths
PATH_TIME = 2.0  # [s]
HALF_FRAME = 0.6  # [m]; acrobot_large
STEP_ROUNDING = 1e-9  # [N]


def smooth(s):
    """Quintic from rest to rest, 0..1."""
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def line(s):
    position = np.array([-0.3, 0.3, 0.2]) + smooth(s) * np.array([0.65, -0.57, 0.25])
    return pose_from_angles(position, np.zeros(3))


def circle(s):
    a = 2.0 * np.pi * smooth(s)
    position = np.array([0.3 * np.cos(a), 0.3 * np.sin(a), 0.3])
    return pose_from_angles(position, 0.1 * np.array([np.sin(a), np.cos(a), 0.0]))


def path_steps(path, method, lower, rate=RATE):
    """Largest tension step and largest displacement of an anchor point from sample to sample."""
    poses = [path(s) for s in np.linspace(0.0, 1.0, int(PATH_TIME * rate) + 1)]
    solutions = [distribute(acrobot(X, lower), method) for X in poses]
    assert all(solution.status == TensionStatus.FEASIBLE for solution in solutions)
    tensions = np.array([solution.tensions for solution in solutions])
    anchors = load_robot("acrobot_large").anchor_points()
    places = np.array([X.multiply(anchors) for X in poses])
    moved = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.max(np.abs(np.diff(tensions, axis=0))), np.max(moved)


WEIGHT = 3.5 * 9.81  # [N]
CONTINUOUS = WEIGHT / HALF_FRAME  # [N/m]; the weight changes sides within half the frame


@pytest.mark.parametrize("lower", [0.0, 1.0])
@pytest.mark.parametrize("path", [line, circle])
@pytest.mark.parametrize("method", ["quadratic_program", "barycenter", "weighted_vertices"])
def test_tensions_follow_a_path_without_jumps(method, path, lower):
    step, moved = path_steps(path, method, lower)
    assert step <= CONTINUOUS * moved + STEP_ROUNDING


@pytest.mark.parametrize("method", ["quadratic_program", "barycenter"])
def test_steps_shrink_with_the_time_between_them(method):
    """As those of a continuous function, at four times the rate to about a quarter."""
    coarse, _ = path_steps(line, method, 1.0)
    fine, _ = path_steps(line, method, 1.0, 4 * RATE)
    assert fine <= 0.3 * coarse


@pytest.mark.parametrize("path", [line, circle])
@pytest.mark.parametrize("method", ["linear_program", "polygon_1_norm"])
def test_the_linear_program_jumps_from_corner_to_corner(method, path):
    step, moved = path_steps(path, method, 0.0)
    assert step > 50.0 * CONTINUOUS * moved
