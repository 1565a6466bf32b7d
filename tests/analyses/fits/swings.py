"""Logs of free motion that Drake's plant made: IRMA4U pushed and left to itself.

    python -m tests.analyses.fits.swings --seeds 100 --group creep

says how well behaviours of cables come back from many noisy swings: shares and chi-squares. The
swing is made once; every seed has noise of its own, and is identified from what is believed.
"""

import argparse
import time as clock
from dataclasses import replace
from functools import cache

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from scipy.spatial.transform import Rotation

from cdpr_drake.analyses.fits.swings import swing_log, swinging_robot
from cdpr_drake.analyses.logs.measurements import Measurements
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.identification.swings import SwingSigmas, SwingTask, fit_swings
from cdpr_drake.models.cable_schema import BehaviourSettings, OwnMaterial
from cdpr_drake.models.platform_schema import HysteresisSettings
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, DampingSettings

START = RigidTransform([0.01, -0.02, 0.45])
BELIEVED = load_robot("irma4u")


def plant_motion(robot, push, times, step, **settings):
    """Pose rows (k, 7) and tensions (k, 4) by Drake's plant, pushed at rest at `START`.

    Args:
        robot: The true robot.
        push: V_WP that it gets, by the pose at rest.
        times: Of rows [s].
        step: Of the integrator [s].
        settings: Of the block.
    """
    settings = CableRobotSettings(cables=CableSettings(pulleys=True), **settings)
    block = CableRobot(robot, settings, floor=False)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, START)
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(4))
    inside = block.GetMutableSubsystemContext(block.plant, context)
    block.plant.SetVelocities(inside, push(block.GetOutputPort("X_WP").Eval(context)))
    simulator.get_mutable_integrator().set_maximum_step_size(step)
    poses, tensions = np.empty((len(times), 7)), np.empty((len(times), 4))
    for k, t in enumerate(times):
        simulator.AdvanceTo(t)
        poses[k] = pose_row(block.GetOutputPort("X_WP").Eval(context))
        tensions[k] = block.GetOutputPort("tensions").Eval(context)
    return poses, tensions


# A log of several swings of another platform on softer cables, by a sensor of turns.

DRAG = (1.2, 0.12)
"""Force per velocity [N s/m], moment per angular velocity [N m s/rad]."""

LOG_RATE = 100.0
"""Rows per second."""

BEFORE = 0.5
"""Time from the push to the log [s], in which what it does along the cables dies out."""

LOG_NOISE = {"turn": 0.002, "tension": 0.5}
"""Of each row [rad, N]."""

LATE, HEADING, MOUNT = 0.012, 0.7, (0.01, 0.05, 0.0)
"""Clock [s], heading and mount [rad] of the sensor of turns."""

CHANGED = {
    "mass": 14.1, "center_of_mass": np.array([0.008, -0.004, 0.155]),
    "inertia": np.array([0.165, 0.11, 0.15, -0.004, 0.003, 0.0]),
}  # fmt: skip
"""What the true platform has otherwise, beside cables."""

SOFTER = 3e10
"""Young's modulus as the search believes it [Pa]: the true one of 4e10 is not far, and steps of the
search's motions, which follow the fastest mode, are longer than with the catalogue's 1e11."""


def believed_file(folder):
    """The robot as it is believed, on softer cables, as a file that commands take."""
    softer = replace(BELIEVED, cable=replace(BELIEVED.cable, youngs_modulus=SOFTER))
    path = folder / "believed.yaml"
    path.write_text(dump_typed(softer), encoding="utf-8")
    return str(path)


@cache
def swing(seed=0, span=2.4):
    """Times [s], turns by the sensor (k, 3) [rad], tensions (k, 4) [N]."""
    random = np.random.default_rng(seed)
    own = OwnMaterial(youngs_modulus=4e10, retardation_time=0.004)
    robot = replace(
        BELIEVED, platform=replace(BELIEVED.platform, **CHANGED),
        cables=[replace(cable, material=own) for cable in BELIEVED.cables],
    )  # fmt: skip
    V = random.uniform(-1.0, 1.0, 6) * [1.2, 1.2, 1.2, 0.25, 0.25, 0.0]
    time = np.arange(round(span * LOG_RATE)) / LOG_RATE
    drag = DampingSettings(translation=DRAG[0], rotation=DRAG[1])
    poses, tensions = plant_motion(robot, lambda _: V, BEFORE + time, 1e-3, damping=drag)
    late = np.column_stack([np.interp(time - LATE, time, poses[:, j]) for j in range(7)])
    turns = Rotation.from_rotvec([0.0, 0.0, HEADING]) * Rotation.from_quat(late[:, [1, 2, 3, 0]])
    turns = turns * Rotation.from_rotvec(MOUNT)
    noise = LOG_NOISE["turn"] * random.standard_normal((len(time), 3))
    turns = turns * Rotation.from_rotvec(noise)
    noisy = tensions + LOG_NOISE["tension"] * random.standard_normal(tensions.shape)
    return time, turns.as_euler("ZYX")[:, ::-1], noisy


def write(path, runs=(0, 1), lengths=None):
    """A log of swings one after the other, a second apart, as `cdpr identify` reads it."""
    header = ["time_s", "roll_rad", "pitch_rad", "yaw_rad"]
    header += [f"C{i + 1}_tension_n" for i in range(4)]
    header += [] if lengths is None else [f"C{i + 1}_length_m" for i in range(4)]
    blocks, begin, spans = [], 0.0, []
    for seed in runs:
        time, turns, tensions = swing(seed)
        more = np.empty((len(time), 0)) if lengths is None else lengths * np.ones((len(time), 4))
        blocks.append(np.column_stack([begin + time, turns, tensions, more]))
        spans.append((begin, begin + float(time[-1])))
        begin += float(time[-1]) + 1.0
    words = {"delimiter": ",", "header": ",".join(header), "comments": ""}
    np.savetxt(path, np.vstack(blocks), fmt="%.9g", **words)
    return spans


# Swings that tell behaviours of cables, of which many seeds are counted.

COUNT, RATE = 60, 50.0
NOISE = SwingSigmas(turn=0.002, position=0.001, tension=0.5)
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


def soft(group=""):
    """IRMA4U on cables as soft as its log says, for steps of two milliseconds."""
    does, rubs = None, None
    true = {name.partition(".")[2]: value for name, value in TRUE.get(group, {}).items()}
    if group in ("stiffening", "creep"):
        does = BehaviourSettings(**true)
    elif group == "hysteresis":
        rubs = HysteresisSettings(**true)
    cable = replace(BELIEVED.cable, youngs_modulus=3e10, retardation_time=0.004, behaviour=does)
    return replace(BELIEVED, cable=cable, platform=replace(BELIEVED.platform, hysteresis=rubs))


def push(X_WP, cables):
    """V_WP of a push along no cable."""
    J = cable_paths(X_WP, cables).J
    v = np.linalg.lstsq(J[:, 3:], -J[:, :3] @ TURNING, rcond=None)[0]
    return np.concatenate([TURNING, v])


@cache
def plant_swing(group):
    """Pose rows and tensions, shapes (k, 7) and (k, 4)."""
    robot, times = soft(group), np.arange(COUNT) / RATE
    return plant_motion(robot, lambda X_WP: push(X_WP, robot.cable_set()), times, STEP)


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
    """A fit of the whole log."""
    whole = ((0.0, (COUNT - 1) / RATE),)
    task = SwingTask(
        robot=swinging_robot(robot), unknown=unknown, stretches=whole, sigmas=NOISE, start=START
    )
    return fit_swings(task, swing_log(robot, log))


def identified(group, seed):
    """The fit of a swing with the noise of a seed."""
    robot = soft()
    if group == "stiffness":
        robot = replace(robot, cable=replace(robot.cable, youngs_modulus=4.5e10))
    log = noisy(*plant_swing(group), np.random.default_rng([seed, 34]))
    return fitted(robot, (group,), log)


def off_by(true, motion):
    """By how many standard errors parameters are off that should be these."""
    sigmas = dict(zip([u.name for u in motion.unknowns], motion.std, strict=True))
    found = motion.model.by_name(motion.values)
    return np.array([(found[name] - value) / sigmas[name] for name, value in true.items()])


def main():
    """Prints what many seeds say."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="Number of the first seed.")
    parser.add_argument("--group", choices=[*TRUE, "all"], default="all")
    options = parser.parse_args()
    for group in TRUE if options.group == "all" else [options.group]:
        began, rows, spreads = clock.process_time(), [], []
        for seed in range(options.first, options.first + options.seeds):
            motion = identified(group, seed)
            rows.append(off_by(TRUE[group], motion))
            spreads.append(motion.spread)
            print(f"{group} {seed}: {motion.steps} steps, {np.round(rows[-1], 2)}", flush=True)
        print(
            f"{group}: {len(rows)} seeds, {clock.process_time() - began:.0f} s of processor; "
            f"residuals {np.mean(spreads):.3f} sigma"
        )
        for name, column in zip(TRUE[group], np.array(rows).T, strict=True):
            print(
                f"  {name}: {np.mean(np.abs(column) < WITHIN):.0%} within {WITHIN:g} sigma, mean "
                f"chi-square {np.mean(column**2):.2f}, mean {np.mean(column):+.2f}, farthest "
                f"{np.max(np.abs(column)):.2f}"
            )


if __name__ == "__main__":
    main()
