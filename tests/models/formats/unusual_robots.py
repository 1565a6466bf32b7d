"""Robots in whose files every field says something, for tests that nothing is lost unsaid."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import yaml

from cdpr_drake.formats.robot_exchange import export_robot
from cdpr_drake.models.robot_loader import load_robot, robot_names, robot_text
from cdpr_drake.models.robot_schema import Robot
from tests.models.robots import robot_of
from tests.motion.small_robots import MOTIONS, small_robot

NAMES = [
    "left-winch",
    "the.long_one",
    "C" * 64,
    "cable__7",
    "7",
    "platform",
    "-50.top",
    "turn_left",
]
"""Of cables: blanks, quotes, letters of other alphabets, words that formats use themselves."""

TILTED = [0.1, -0.2, -0.97]


def robot_with_everything(**changes: object) -> Robot:
    """A robot of eight cables in whose file every field is given, none at a common value."""
    made = yaml.safe_load(robot_text("acrobot_large"))
    made |= {
        "name": "Every.thing", "title": 'All of "it" – Größe <1> & more', "gravity": 3.71,
        "slack_readings": [0.1 * k for k in range(8)], "assumptions": "None: it is made up.",
        "tension_bounds": {"lower": 3.25, "upper": 611.0},
        "cable_model": "elastic", "damping": {"translation": 12.5, "rotation": 0.7},
        "pulley": {"radius": 0.031, "swivel_axis": [0.1, 0.2, 1.0]},
        "platform_pulley": {"radius": 0.004, "swivel_axis": [0.3, 0.0, 1.0]},
        "cable": {"youngs_modulus": 7.7e10, "diameter": 0.0023, "linear_density": 0.021,
                  "retardation_time": 2e-4, "breaking_load": 2345.0,
                  "behaviour": {"stiffening": 1e-4, "expansion": 1.1e-5, "warmer": -7.0,
                                "sheave_friction": 0.03, "sliding_speed": 2e-3,
                                "creep_stiffness": 0.2, "creep_time": 30.0}},
        "winch": {"drum_radius": 0.037, "gear_ratio": 7.0, "motor_speed_rpm": 2900.0,
                  "motor_torque": 1.7, "inertia": 3e-4, "brake_torque": 2.5,
                  "friction": {"coulomb": 0.01, "static": 0.02, "viscous": 1e-4,
                               "stribeck_speed": 3.0, "settling_time": 2e-3},
                  "layers": {"turns": 9.0, "height": 0.002, "wound": 1.5},
                  "loops": {"velocity_bandwidth": 150.0, "position_bandwidth": 15.0}},
    }  # fmt: skip
    size = np.array(made["platform"]["size"])
    made["platform"] = {
        "mass": 33.0, "size": size.tolist(), "box_center": [0.01, -0.02, 0.045],
        "center_of_mass": [0.013, -0.007, 0.021],
        "inertia": [0.05, 0.06, 0.07, 0.003, -0.002, 1e-3],
        "shape": {"kind": "cylinder", "radius": float(size[:2].min()) / 2.5,
                  "height": float(size[2]) / 2, "position": [0.011, -0.021, 0.045],
                  "angles_deg": [0.0, 0.0, 20.0]},
        "inertia_of": "shape", "hysteresis": {"tilt": 0.7, "turn": 1.3, "slip": 0.03},
    }  # fmt: skip
    made["frame"] |= {
        "beam": 0.033,
        "beams": [{"start": [0, 0, 0], "end": [0, 0, 1], "width": 0.1}],
    }
    made["home"] = {"position": [0.02, -0.03, 0.31], "angles_deg": [4.0, -3.0, 8.0]}
    made["cameras"] = [
        {"name": "down", "model": made["cameras"][0]["model"], "parent": "world",
         "pose": {"position": [0.1, 0.2, 0.3], "angles_deg": [10.0, 0.0, 5.0]}},
    ]  # fmt: skip
    for name, cable in zip(NAMES, made["cables"], strict=True):
        cable["name"] = name
    own = {"youngs_modulus": 6.1e10, "linear_density": 0.033, "retardation_time": 5e-4,
           "breaking_load": 3456.0}  # fmt: skip
    made["cables"][0] |= {"pulley_radius": 0.017, "swivel_axis": [0.0, 1.0, 0.3], "material": own}
    made["cables"][1] |= {"material": {"diameter": 0.0031}}
    made["cables"][1] |= {"mechanical_advantage": 2.0, "drum_radius": 0.031}
    made["cables"][2] |= {"anchor_pulley_radius": 0.006, "anchor_swivel_axis": [1.0, 0.0, 0.5]}
    made["cables"][3] |= {"rail": {"axis": [0, 0, 1], "lower": -0.1, "upper": 0.1, "at": 0.05}}
    made["cables"][4] |= {"winch": "pair"}
    made["cables"][5] |= {"winch": "pair"}
    made["cables"][6] |= {"pulley_radius": 0.0, "swivel_axis": [1.0, 0.0, 0.0]}
    return robot_of(made | changes)


def slack_robot() -> Robot:
    """One without a title, exit points outside its frame, a mass off the middle of its box, Po."""
    made = yaml.safe_load(robot_text("acrobot_large"))
    made |= {"name": "Outside_1", "title": "", "assumptions": ""}
    exits = np.array([cable["exit_point"] for cable in made["cables"]])
    made["frame"] = {"lower": [*(exits.min(axis=0) + 0.1)[:2].tolist(), 0.0],
                     "upper": (exits.max(axis=0) - 0.1).tolist()}  # fmt: skip
    made["home"] = {"position": [0.0, 0.0, 0.3], "angles_deg": [0.0, 0.0, 20.0]}
    made["platform"] |= {"size": [0.3, 0.3, 0.3], "box_center": [0.0, 0.0, 0.0],
                         "center_of_mass": [0.01, 0.0, 0.0]}  # fmt: skip
    return robot_of(made)


def planar_robot() -> Robot:
    """One in a plane with everything that such a robot may have."""
    made = yaml.safe_load(robot_text("planar"))
    made |= {"name": "flat-one", "title": "Flat\none", "gravity": 1.62, "plane_height": 0.123}
    made["platform"]["box_center"] = [0.01, 0.02, 0.03]
    made["home"]["position"][2] = 0.123
    made["pulley"] = {"radius": 0.01, "swivel_axis": [0.0, 0.0, -1.0]}
    for cable, name in zip(made["cables"], NAMES, strict=False):
        cable["name"] = name
    made["cables"][1] |= {"pulley_radius": 0.02, "swivel_axis": [0.0, 0.1, 1.0]}
    made["tension_bounds"] = {"lower": 2.5, "upper": 77.0}
    return robot_of(made)


def tilted_robot() -> Robot:
    """The first one with gravity that is off -z, and a frame that was assumed."""
    robot = robot_with_everything(name="tilted", gravity_direction=TILTED)
    robot.frame.assumed = True
    return robot


def robot_with_arms() -> Robot:
    """A point in a plane on arms of a length of its own."""
    made = yaml.safe_load(robot_text("maslow_4"))
    made |= {"name": "arms", "title": "Arms"}
    made["pulley"]["arm"] = 0.1234
    return robot_of(made)


UNUSUAL = {
    "everything": robot_with_everything,
    "outside": slack_robot,
    "flat": planar_robot,
    "tilted": tilted_robot,
    "arms": robot_with_arms,
}
"""What makes each robot."""

ALL = [*UNUSUAL, *MOTIONS, *robot_names()]
"""Names of all robots that go out and in."""


@cache
def made(name: str) -> Robot:
    """The robot of a name; nobody changes it."""
    if name in UNUSUAL:
        return UNUSUAL[name]()
    return small_robot(name) if name in MOTIONS else load_robot(name)


@cache
def exported(name: str, format: str) -> dict[str, str]:
    """Its files, made once; nobody changes them."""
    return export_robot(made(name), format)


def written(files: dict[str, str], folder: Path) -> Path:
    """The first of these files, in a folder with the others."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / next(iter(files))
