"""Logs of free motion that Drake's plant made: IRMA4U pushed and left to itself."""

from dataclasses import replace
from functools import cache

import numpy as np
from pydrake.common.yaml import yaml_dump_typed
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from scipy.spatial.transform import Rotation

from cdpr_drake.geometry.poses import pose_row
from cdpr_drake.models.materials import OwnMaterial
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.cable_robot import CableRobot
from cdpr_drake.systems.robots.settings import CableRobotSettings, CableSettings, DampingSettings

BELIEVED = load_robot("irma4u")
DRAG = (1.2, 0.12)
"""Force per velocity [N s/m], moment per angular velocity [N m s/rad]."""

RATE = 100.0
"""Rows per second."""

BEFORE = 0.5
"""Time from the push to the log [s], in which what it does along the cables dies out."""

NOISE = {"turn": 0.002, "tension": 0.5}
"""Of each row [rad, N]."""

LATE, HEADING, MOUNT = 0.012, 0.7, (0.01, 0.05, 0.0)
"""Clock [s], heading and mount [rad] of the sensor of turns."""

CHANGED = {"mass": 14.1, "center_of_mass": (0.008, -0.004, 0.155)}
"""What the true platform has otherwise, beside inertia and cables."""


SOFTER = 3e10
"""Young's modulus as the search believes it [Pa]: the true one of 4e10 is not far, and steps of the
search's motions, which follow the fastest mode, are longer than with the catalogue's 1e11."""


def believed_file(folder):
    """The robot as it is believed, on softer cables, as a file that commands take."""
    softer = replace(BELIEVED, cable=replace(BELIEVED.cable, youngs_modulus=SOFTER))
    path = folder / "believed.yaml"
    path.write_text(yaml_dump_typed(softer), encoding="utf-8")
    return str(path)


def true_robot():
    """The robot that swings: another platform, and softer cables with more damping."""
    platform = replace(
        BELIEVED.platform, mass=CHANGED["mass"],
        center_of_mass=np.array(CHANGED["center_of_mass"]),
        inertia=np.array([0.165, 0.11, 0.15, -0.004, 0.003, 0.0]),
    )  # fmt: skip
    own = OwnMaterial(youngs_modulus=4e10, retardation_time=0.004)
    cables = [replace(cable, material=own) for cable in BELIEVED.cables]
    return replace(BELIEVED, platform=platform, cables=cables)


@cache
def swing(seed=0, span=2.4, late=LATE):
    """Times [s], true poses (k, 7), turns by the sensor (k, 3) [rad], tensions (k, 4)."""
    robot, random = true_robot(), np.random.default_rng(seed)
    settings = CableRobotSettings(
        cables=CableSettings(pulleys=True),
        damping=DampingSettings(translation=DRAG[0], rotation=DRAG[1]),
    )
    block = CableRobot(robot, settings, floor=False)
    simulator = Simulator(block)
    context = simulator.get_mutable_context()
    block.set_at_equilibrium(context, RigidTransform([0.01, -0.02, 0.45]))
    block.GetInputPort("cable_velocities").FixValue(context, np.zeros(4))
    plant = block.plant
    inside = block.GetMutableSubsystemContext(plant, context)
    V = random.uniform(-1.0, 1.0, 6) * [1.2, 1.2, 1.2, 0.25, 0.25, 0.0]
    plant.SetVelocities(inside, plant.GetVelocities(inside) + V)
    simulator.get_mutable_integrator().set_maximum_step_size(1e-3)
    time = np.arange(round(span * RATE)) / RATE
    poses, tensions = np.empty((len(time), 7)), np.empty((len(time), 4))
    for k, t in enumerate(time):
        simulator.AdvanceTo(BEFORE + t)
        poses[k] = pose_row(block.GetOutputPort("X_WP").Eval(context))
        tensions[k] = block.GetOutputPort("tensions").Eval(context)
    seen = np.column_stack([np.interp(time - late, time, poses[:, j]) for j in range(7)])
    turns = Rotation.from_rotvec([0.0, 0.0, HEADING]) * Rotation.from_quat(seen[:, [1, 2, 3, 0]])
    turns = turns * Rotation.from_rotvec(MOUNT)
    turns = turns * Rotation.from_rotvec(NOISE["turn"] * random.standard_normal((len(time), 3)))
    noisy = tensions + NOISE["tension"] * random.standard_normal(tensions.shape)
    return time, poses, turns.as_euler("ZYX")[:, ::-1], noisy


def write(path, runs=(0, 1), lengths=None):
    """A log of swings one after the other, a second apart, as `cdpr identify` reads it."""
    header = ["time_s", "roll_rad", "pitch_rad", "yaw_rad"]
    header += [f"C{i + 1}_tension_n" for i in range(4)]
    header += [] if lengths is None else [f"C{i + 1}_length_m" for i in range(4)]
    lines, begin, spans = [",".join(header)], 0.0, []
    for seed in runs:
        time, _, turns, tensions = swing(seed)
        rows = np.column_stack([begin + time, turns, tensions])
        if lengths is not None:
            rows = np.column_stack([rows, lengths * np.ones((len(time), 4))])
        lines += [",".join(f"{x:.9g}" for x in row) for row in rows]
        spans.append((begin, begin + float(time[-1])))
        begin += float(time[-1]) + 1.0
    path.write_text("\n".join(lines) + "\n")
    return spans
