"""What all loops of a scheme have in common, and where they start."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.studies.perturbed_servo import (
    PerturbedServo,
    servo_case,
)
from cdpr_drake.analyses.workspaces.static_feasible import static_case
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_angles
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.stability_case import StabilityCase
from cdpr_drake.stability.verdict import VerdictOptions
from cdpr_drake.systems.cameras.camera_settings import servo_pinhole
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import check_loop
from cdpr_drake.systems.robots.cable_robot import automatic_step
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.workspaces.static_feasibility import StaticCase

ROBOT = "acrobot_large"

SCHEMES = ("pbvs", "2.5d", "ibvs")

SEED = 3
"""Of the model's errors; the verdicts look with others."""

OPTIONS = VerdictOptions(margins=False, threads=1)

DURATION = 40.0
"""Loops end after this time at the latest [s]; those that converge take a third of it."""

LOG_RATE = 5.0
"""Poses of a path that are kept [1/s]."""

SETTINGS = (
    f"robot={ROBOT}",
    "camera.kind=projected",
    "camera.pixel_noise=0",
    "target.pose.position=[0, 0, 0]",
    "desired.position=[0, 0, 0.3]",
    f"duration={DURATION}",
    f"log_rate={LOG_RATE}",
    "integration.loop=compiled",
)
"""What differs from the scenario acrobot_pbvs; as in the study stability-closed-loop the tag lies
in the middle of the floor, and images have no noise, so that errors of the model are all."""

LOWEST = 0.15
"""Starts keep this height, so that the tag can be in front of the camera [m]."""

TILT_DEG, YAW_DEG = 30.0, 90.0
"""Starts are turned by angles phi, theta and psi up to these [deg]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class BasinSetup:
    """What all loops of a scheme have in common.

    Attributes:
        scenario: The task of the servo, as the compiled loop does it.
        servo: The servo without errors of its model.
        pinhole: Its camera.
        case: The same for the verdicts.
        statics: What the cables have to hold.
        bounds: What limits the errors.
        box: Lower and upper corner of where Po may start, shape (3,) each [m].
    """

    scenario: Scenario
    servo: PerturbedServo
    pinhole: Pinhole
    case: StabilityCase
    statics: StaticCase
    bounds: PerturbationBounds
    box: tuple[Array, Array]

    def is_seen(self, X_WP: RigidTransform) -> bool:
        """Whether the tag is in the image at a pose [m]."""
        return self.servo.target.in_view(self.servo.X_CO(X_WP), self.pinhole)


@cache
def basin_setup(scheme: str) -> BasinSetup:
    """What all loops of a scheme have in common."""
    scenario = load_scenario("acrobot_pbvs", [*SETTINGS, f"controller.scheme={scheme}"])
    robot, common = load_robot(ROBOT), servo_case(scenario, LOWEST)
    box = common.box
    # One step for all loops: to find one for each start takes as long as a third of the loop.
    corners = np.stack(np.meshgrid(*np.transpose(box), indexing="ij"), axis=-1).reshape(-1, 3)
    scenario.integration.max_step = min(
        automatic_step(robot, RigidTransform(p), scenario.integration.integrator, scenario)
        for p in (*corners, np.mean(box, axis=0))
    )
    return BasinSetup(
        scenario=check_loop(scenario),
        servo=common.servo,
        pinhole=servo_pinhole(scenario.camera, robot),
        case=common.case,
        statics=static_case(robot, pulleys=False),
        bounds=common.bounds,
        box=box,
    )


def start_poses(box: tuple[Array, Array], start: int, stop: int) -> list[RigidTransform]:
    """Points start to stop of a sequence of poses that fills the box and the turns evenly [m].

    Any first points of it are an even picture of the whole, and each is the same in any chunk.

    Source: Halton's sequence; J. H. Halton, Numerische Mathematik 2, 1960.
    """
    from scipy.stats import qmc  # as much to import as all of numba, and only workers ask

    sequence = qmc.Halton(d=6, scramble=False)
    sequence.fast_forward(start + 1)  # the first point is a corner
    widest = np.radians([TILT_DEG, TILT_DEG, YAW_DEG])
    lower, upper = np.concatenate([box[0], -widest]), np.concatenate([box[1], widest])
    numbers = lower + (upper - lower) * sequence.random(stop - start)
    return [pose_from_angles(row[:3], row[3:]) for row in numbers]
