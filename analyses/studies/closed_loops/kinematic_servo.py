"""The closed loop as the stability criterion has it: kinematics alone, no masses, no slack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.framework.servo_models import PerturbedServo
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import exponential
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.monitoring.run_monitor import Outcome

STEP = 0.02
"""Step, times the gain [-]."""

REACHED = 1e-3
"""The loop has converged when the error is this share of what it was."""

LONGEST_TIME = 100.0
"""Without convergence the loop ends after this time, times the gain [-]."""


@dataclass(frozen=True, eq=False)
class KinematicPath:
    """What the loop did.

    Attributes:
        poses: X_WP at each step.
        errors: |e| at each step (of ibvs: |L^+ e|), shape (n,) [rad, m].
        outcome: CONVERGED, TARGET_LOST when it left the image, DIVERGED when the platform left the
            frame, or TIMEOUT.
    """

    poses: list[RigidTransform]
    errors: Array
    outcome: Outcome


def kinematic_path(servo: PerturbedServo, X_WP: RigidTransform) -> KinematicPath:
    """Runs de/dt = -Pi e from a pose [m], with unit gain, until it converges or fails.

    The servo asks for cable velocities by what it believes, with an estimate that is always off by
    the perturbation; the platform moves as the true cables' least squares have it.

    Source: servoing thesis (1.40).
    """
    settings = servo.scenario.camera
    pinhole = servo_pinhole(settings, servo.robot)
    lower, upper = servo.robot.frame.bounds()
    local = servo.scenario.controller.scheme == "ibvs"
    poses, errors = [], []
    outcome = Outcome.TIMEOUT
    for _ in range(round(LONGEST_TIME / STEP)):
        if not servo.target.in_view(servo.X_CO(X_WP), pinhole):
            outcome = Outcome.TARGET_LOST
            break
        p = X_WP.translation()
        if np.any(p < lower) or np.any(p > upper):
            outcome = Outcome.DIVERGED
            break
        e, L = servo.error(X_WP)
        wanted = np.linalg.pinv(L) @ e
        poses.append(X_WP)
        errors.append(float(np.linalg.norm(wanted if local else e)))
        if errors[-1] <= REACHED * errors[0]:
            outcome = Outcome.CONVERGED
            break
        truth, estimate = servo.models(X_WP)
        rates = -estimate.camera_jacobian() @ wanted
        V_C = np.linalg.pinv(truth.camera_jacobian()) @ rates
        X_WP = X_WP @ servo.X_PC @ exponential(STEP * V_C) @ servo.X_PC.inverse()
    return KinematicPath(poses, np.array(errors), outcome)
