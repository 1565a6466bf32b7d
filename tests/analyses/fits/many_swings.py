"""How well behaviours of cables come back from many noisy swings: shares and chi-squares.

    python -m tests.analyses.fits.many_swings --seeds 100 --group creep

The swing is made once by Drake's plant; every seed has noise of its own, and is identified from
what is believed beforehand.
"""

import argparse
import time as clock
from dataclasses import replace
from functools import cache

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.calibration.free_motion import FreeMotionTask, FreeSigmas, fit_free_motion
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.materials import BehaviourSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import HysteresisSettings
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings

START, COUNT, RATE = RigidTransform([0.01, -0.02, 0.45]), 60, 50.0
NOISE = FreeSigmas(turn=0.002, position=0.001, tension=0.5)
TURNING = np.array([1.5, -1.0, 2.5])
"""Angular velocity of the push [rad/s]."""

STEP = 5e-4
"""Of Drake's integrator [s]: an eighth of what is stable; its error is a thousandth of noise."""

WITHIN = 3.0
"""Standard errors within which a value shall be."""

TRUE = {
    "hysteresis": {"hysteresis.tilt": 4.0, "hysteresis.turn": 6.0, "hysteresis.slip": 0.08},
    "stiffening": {"all.stiffening": 6e-3},
    "creep": {"all.creep_stiffness": 0.3, "all.creep_time": 0.3},
    "stiffness": {"all.stiffness": 3e10 * np.pi * 1e-6},
}
"""What the swings are made with; a modulus is believed by half more."""


def soft(group):
    """IRMA4U on cables as soft as its log says, for steps of two milliseconds; as it is."""
    robot, does, rubs = load_robot("irma4u"), None, None
    true = {name.partition(".")[2]: value for name, value in TRUE.get(group, {}).items()}
    if group in ("stiffening", "creep"):
        does = BehaviourSettings(**true)
    elif group == "hysteresis":
        rubs = HysteresisSettings(**true)
    cable = replace(robot.cable, youngs_modulus=3e10, retardation_time=0.004, behaviour=does)
    return replace(robot, cable=cable, platform=replace(robot.platform, hysteresis=rubs))


def believed(group):
    """The same as it is believed."""
    robot = soft("")
    if group != "stiffness":
        return robot
    return replace(robot, cable=replace(robot.cable, youngs_modulus=4.5e10))


def push(X_WP, cables):
    """V_WP of a push along no cable."""
    J = cable_paths(X_WP, cables).J
    v = np.linalg.lstsq(J[:, 3:], -J[:, :3] @ TURNING, rcond=None)[0]
    return np.concatenate([TURNING, v])


@cache
def plant_swing(group):
    """Pose rows and tensions, shapes (k, 7) and (k, 4), by Drake's plant."""
    robot = soft(group)
    block = CableRobot(robot, CableRobotSettings(cables=CableSettings(pulleys=True)), floor=False)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, START)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(4))
    inside = block.GetMutableSubsystemContext(block.plant, context)
    X_WP = block.GetOutputPort("X_WP").Eval(context)
    block.plant.SetVelocities(inside, push(X_WP, robot.cable_set()))
    simulator.get_mutable_integrator().set_maximum_step_size(STEP)
    poses, tensions = np.empty((COUNT, 7)), np.empty((COUNT, 4))
    for k in range(COUNT):
        simulator.AdvanceTo(k / RATE)
        poses[k] = pose_row(block.GetOutputPort("X_WP").Eval(context))
        tensions[k] = block.GetOutputPort("tensions").Eval(context)
    return poses, tensions


def noisy(poses, tensions, random):
    """A log of pose rows, shape (k, 7) or more, and tensions, with noise."""
    turns = Rotation.from_quat(poses[:, [1, 2, 3, 0]])
    turns = turns * Rotation.from_rotvec(NOISE.turn * random.standard_normal((COUNT, 3)))
    places = poses[:, 4:7] + NOISE.position * random.standard_normal((COUNT, 3))
    rows = [
        RigidTransform(RotationMatrix(R), p) for R, p in zip(turns.as_matrix(), places, strict=True)
    ]
    return Measurements(
        "swing", COUNT, time=np.arange(COUNT) / RATE, poses=rows,
        tensions=tensions + NOISE.tension * random.standard_normal(tensions.shape),
    )  # fmt: skip


def fitted(robot, unknown, log):
    """What a fit of the whole log finds."""
    whole = ((0.0, (COUNT - 1) / RATE),)
    task = FreeMotionTask(robot=robot, unknown=unknown, stretches=whole, sigmas=NOISE, start=START)
    return fit_free_motion(task, log)


def identified(group, seed):
    """What the fit of a swing with the noise of a seed found."""
    log = noisy(*plant_swing(group), np.random.default_rng([seed, 34]))
    return fitted(believed(group), (group,), log)


def off_by(group, found):
    """By how many standard errors each parameter is off."""
    by_name = {
        u.name: (x, s) for u, x, s in zip(found.unknowns, found.values, found.std, strict=True)
    }
    return np.array([(by_name[n][0] - true) / by_name[n][1] for n, true in TRUE[group].items()])


def main():
    """Prints what many seeds say."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="Number of the first seed.")
    parser.add_argument("--group", choices=[*TRUE, "all"], default="all")
    asked = parser.parse_args()
    for group in TRUE if asked.group == "all" else [asked.group]:
        began, rows, spreads, unsettled = clock.process_time(), [], [], 0
        for seed in range(asked.first, asked.first + asked.seeds):
            found = identified(group, seed)
            rows.append(off_by(group, found))
            spreads.append(found.spread)
            unsettled += any("before it settled" in words for words in found.remarks)
            print(f"{group} {seed}: {found.steps} steps, {np.round(rows[-1], 2)}", flush=True)
        table = np.array(rows)
        print(
            f"{group}: {len(table)} seeds, {clock.process_time() - began:.0f} s of processor; "
            f"residuals {np.mean(spreads):.3f} sigma; {unsettled} not settled"
        )
        for name, column in zip(TRUE[group], table.T, strict=True):
            print(
                f"  {name}: {np.mean(np.abs(column) < WITHIN):.0%} within {WITHIN:g} sigma, mean "
                f"chi-square {np.mean(column**2):.2f}, mean {np.mean(column):+.2f}, farthest "
                f"{np.max(np.abs(column)):.2f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
