"""Small robots of each motion type, and with fewer cables than degrees of freedom."""

from copy import deepcopy
from functools import cache
from pathlib import Path

import yaml

from cdpr_drake.models.robot_loader import parse_robot
from cdpr_drake.models.robot_schema import Robot

SHARED = """\
title: A small robot for tests
cable: {youngs_modulus: 5.0e8, diameter: 0.002, linear_density: 0.004, retardation_time: 1.0e-3}
pulley: {radius: 0.0}
winch: {drum_radius: 0.05, gear_ratio: 20.0, motor_speed_rpm: 1500.0, motor_torque: 2.0}
tension_bounds: {lower: 0.0, upper: 500.0}
frame: {lower: [-2.0, -2.0, -2.0], upper: [2.0, 2.0, 2.0], beam: 0.05}
"""

POINT = {"mass": 2.0, "size": [0.1, 0.1, 0.1], "box_center": [0.0, 0.0, 0.0]}
BODY = {
    "mass": 3.0,
    "size": [0.4, 0.3, 0.1],
    "box_center": [0.0, 0.0, 0.0],
    "center_of_mass": [0.02, 0.01, -0.03],
}
FLAT = {"mass": 3.0, "size": [0.4, 0.3, 0.2], "box_center": [0.0, 0.0, 0.0]}
"""Of a body in a plane: the centre of mass is in Po, in every plane."""
BEAM = {"mass": 2.0, "size": [0.05, 0.05, 0.6], "box_center": [0.0, 0.0, 0.0]}


def _lines(pairs):
    return [
        {"name": f"c{k}", "exit_point": list(map(float, A)), "anchor_point": list(map(float, B))}
        for k, (A, B) in enumerate(pairs)
    ]


O = (0.0, 0.0, 0.0)  # noqa: E741
TOP = [(-1.5, -1.5, 2.0), (1.5, -1.5, 2.0), (1.5, 1.5, 2.0), (-1.5, 1.5, 2.0)]
CORNERS = [(-0.2, -0.15, 0.05), (0.2, -0.15, 0.05), (0.2, 0.15, 0.05), (-0.2, 0.15, 0.05)]

MOTIONS = {
    "pendulum": {"motion": "3T", "platform": POINT, "home": [0.0, 0.0, 0.5],
                 "cables": [((0, 0, 2), O)]},
    "body_pendulum": {"platform": BODY, "home": [0.0, 0.0, 0.5],
                      "cables": [((0, 0, 2), (0.0, 0.0, 0.05))]},
    "lift": {"motion": "1T", "platform": POINT, "home": [0.3, 0.0, 0.5],
             "cables": [((0.3, 0.4, 2), O), ((0.3, 0.4, -2), O)]},
    "slope": {"motion": "1T", "axis": [1.0, 0.0, 1.0], "platform": POINT, "home": [0.3, 0.1, 0.5],
              "cables": [((1.5, 0.1, 1.9), O), ((-1.9, 0.1, -1.5), O)]},
    "level_point": {"motion": "2T", "platform": POINT, "home": [0.2, -0.1, 0.3],
                    "cables": [((-1, -1, 0.3), O), ((1, -1, 0.3), O), ((0, 1.2, 0.3), O)]},
    "upright_point": {"motion": "2T", "axis": [0.0, 1.0, 0.0], "platform": POINT,
                      "home": [0.2, 0.1, 0.3], "cables": [((-1.5, 0.1, 2), O), ((1.5, 0.1, 2), O)]},
    "tripod": {"motion": "3T", "platform": POINT, "home": [0.1, 0.2, 0.3],
               "cables": [((-1.5, -1, 2), O), ((1.5, -1, 2), O), ((0, 1.6, 2), O)]},
    "upright_body": {"motion": "1R2T", "axis": [0.0, 1.0, 0.0], "platform": FLAT,
                     "home": [0.1, 0.2, 0.3],
                     "cables": [((-1.5, 0.2, 2), (-0.2, 0, 0.1)), ((1.5, 0.2, 2), (0.2, 0, 0.1)),
                                ((-1.5, 0.2, -1.5), (-0.2, 0, -0.1)),
                                ((1.5, 0.2, -1.5), (0.2, 0, -0.1))]},
    "oblique_body": {"motion": "2T1R", "axis": [0.3, 1.0, 0.2], "platform": FLAT,
                     "home": [0.1, 0.2, 0.3],
                     "cables": [((-1.5, 0.2, 2), (-0.2, 0, 0.1)), ((1.5, 0.2, 2), (0.2, 0, 0.1)),
                                ((-1.5, 0.2, -1.5), (-0.2, 0, -0.1)),
                                ((1.5, 0.2, -1.5), (0.2, 0, -0.1))]},
    "beam": {"motion": "2R3T", "platform": BEAM, "home": [0.1, 0.2, 0.3], "angles": [20, 30, 10],
             "cables": [(TOP[0], (0, 0, 0.3)), (TOP[1], (0, 0, 0.3)), (TOP[2], (0, 0, 0.3)),
                        (TOP[3], (0, 0, -0.3)), ((-1.5, -1.5, -2), (0, 0, -0.3)),
                        ((1.5, 1, -2), (0, 0, -0.3))]},
    "hanging_four": {"platform": BODY, "home": [0.1, 0.05, 0.3],
                     "cables": list(zip(TOP, CORNERS, strict=True))},
    "tilted_gravity": {"platform": BODY, "home": [0.0, 0.0, 0.3],
                       "gravity_direction": [0.3, -0.2, -1.0],
                       "cables": list(zip(TOP, CORNERS, strict=True))},
}  # fmt: skip
"""What each robot is, beside what all share."""


def content(name, **changes):
    """The robot file of one of `MOTIONS` as a mapping."""
    given = dict(MOTIONS[name])
    made = {"name": name, **yaml.safe_load(SHARED)}
    made["cables"] = _lines(given.pop("cables"))
    made["home"] = {"position": given.pop("home"), "angles_deg": given.pop("angles", [0, 0, 0])}
    return made | given | changes


@cache
def _checked(name) -> Robot:
    return parse_robot(yaml.safe_dump(content(name)), Path(f"{name}.yaml"))


def small_robot(name, **changes) -> Robot:
    """One of `MOTIONS`, checked."""
    if not changes:
        return deepcopy(_checked(name))
    return parse_robot(yaml.safe_dump(content(name, **changes)), Path(f"{name}.yaml"))
