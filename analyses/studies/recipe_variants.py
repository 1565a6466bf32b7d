"""Variants of the recipe for the stability tables: each names what it takes otherwise.

`cdpr study control-stability --recipe NAME` evaluates one on all rows at once; none is better for
meeting rows that it was chosen on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.yaml_files import load_yaml

FULLY_CONSTRAINED = "acrobot_fully_constrained"

AS_IN_FILE, KEPT_CABLES = "as in the robot's file", "kept cables"
UPPER_ON_UPPER, OTHER_CORNERS = "upper on upper", "upper on upper, other corners"
LOWER_ON_UPPER = "lower on upper, other corners"
EXCHANGED = "as in the robot's file, but for one exchange"
"""Which anchor points the cables of the fully constrained ACROBOT hold.

The exit points of table 3.1 lie in plan exactly where those of table A.1 do, numbered otherwise.
AS_IN_FILE: by the numbers of tables 3.1 and A.1; cables from the floor hold the upper points.
KEPT_CABLES: each cable keeps its anchor point of the suspended robot, and four exit points move
straight down. UPPER_ON_UPPER: cables from above hold the upper points, each at the corner with the
sign of its exit point along x and the other sign along y. OTHER_CORNERS: with the other sign along
x and the same along y. LOWER_ON_UPPER: at these corners, cables from the floor hold the upper ones.
`arranged_anchors` gives all of this kind. EXCHANGED: by the numbers of both tables, but A4 and A6
in each other's place, `exchanged_anchors` with `EXCHANGE`.
"""

EXCHANGE = (3, 5)
"""Numbers of the cables of EXCHANGED, from 0: A4 and A6, from above on the side of +x."""

SUSPENDED = "acrobot_large"

VARIED_POINTS = {"acrobot": "corners", "planar": "independent", "caroca": "common"}
"""How points are wrong in the rows that vary them, by the first word of the robot's name."""

LOWER_CORNER, OPPOSITE_CORNER, CENTRE = "lower corner", "opposite corner", "centre"
"""Where spatial robots go under PBVS: to the lower corner of the grid's box from everywhere, from
each pose to the corner that is farthest, or to the centre of the box."""

PLATFORM, AS_BUILT, FACING_DOWN = "platform", "as built", "facing down"
"""Camera at the platform's origin and aligned with it; as in the robot's file; or above the origin,
by `CAMERA_HEIGHTS`, and looking down."""

CAMERA_HEIGHTS = {"acrobot": 0.08, "caroca": 0.2}
"""Height of the camera FACING_DOWN above the platform's origin, by the first word of the robot's
name [m]."""


@cache
def shipped_robot(name: str) -> Robot:
    """A robot that ships, read once for the hundreds of cases of a study; nobody changes it."""
    return load_robot(name)


@dataclass(frozen=True)
class View:
    """What the camera sees under 2 1/2 D, at every pose.

    Attributes:
        place: Position of the object in the camera frame [m].
        turn: Rotation error theta u [rad].
    """

    place: tuple[float, float, float] = (0.0, -0.4, 0.45)
    turn: tuple[float, float, float] = (-math.radians(120.0), 0.0, 0.0)


@dataclass(frozen=True)
class Recipe:
    """A recipe.

    Attributes:
        name: For --recipe.
        words: What it takes otherwise than `present`.
        anchors: AS_IN_FILE, KEPT_CABLES, UPPER_ON_UPPER, OTHER_CORNERS, LOWER_ON_UPPER or
            EXCHANGED.
        points: How points are wrong in the rows that vary them, one of `DIRECTIONS`, by the first
            word of the robot's name or its whole name, alone or after a scheme, or after a scheme
            and a bound ("2.5d r_A acrobot"); what says more comes first.
        goal: LOWER_CORNER, OPPOSITE_CORNER or CENTRE.
        goals: The same for single robots by name, before `goal`.
        turn: Rotation error theta u of spatial robots under PBVS [rad].
        seen: Rotation errors theta u of robots by name, before `turn`, with whom an error of the
            camera's mounting also turns what is seen under PBVS [rad].
        view: What is seen under 2 1/2 D.
        camera: PLATFORM, AS_BUILT or FACING_DOWN.
        sight: Rows that it was chosen with, beside those of `present`; empty: none.
    """

    name: str
    words: str
    anchors: str = AS_IN_FILE
    points: Mapping[str, str] = field(default_factory=lambda: dict(VARIED_POINTS))
    goal: str = LOWER_CORNER
    goals: Mapping[str, str] = field(default_factory=dict)
    turn: tuple[float, float, float] = (0.0, 0.0, math.pi)
    seen: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    view: View = field(default_factory=View)
    camera: str = PLATFORM
    sight: str = ""

    def directions(self, robot: str, scheme: str = "pbvs", bound: str = "r_A") -> str:
        """How points of a robot are wrong in the rows that vary them."""
        for name in (robot, robot.split("_")[0]):
            for words in (f"{scheme} {bound} {name}", f"{scheme} {name}", name):
                if words in self.points:
                    return self.points[words]
        raise KeyError(robot)

    def mounting(self, robot: str) -> RigidTransform:
        """Pose of the camera on the platform of a robot."""
        if self.camera == PLATFORM:
            return RigidTransform()
        if self.camera == FACING_DOWN:
            height = CAMERA_HEIGHTS[robot.split("_")[0]]
            return RigidTransform(RotationMatrix.MakeXRotation(math.pi), np.array([0, 0, height]))
        return shipped_robot(robot).cameras[0].pose.transform()

    def cables(self, robot: str) -> CableSet:
        """The cables of a robot, without pulleys."""
        cables = shipped_robot(robot).cable_set().without_pulleys()
        if robot != FULLY_CONSTRAINED or self.anchors == AS_IN_FILE:
            return cables
        if self.anchors == KEPT_CABLES:
            before = shipped_robot(SUSPENDED).cable_set()
            away = np.linalg.norm(
                cables.p_WA[:2, :, np.newaxis] - before.p_WA[:2, np.newaxis, :], axis=0
            )
            return replace(cables, p_PB=before.p_PB[:, np.argmin(away, axis=1)])
        if self.anchors == EXCHANGED:
            return exchanged_anchors(cables, *EXCHANGE)
        flips = (False, True) if self.anchors == UPPER_ON_UPPER else (True, False)
        return arranged_anchors(cables, flips, flips, self.anchors == LOWER_ON_UPPER)


def arranged_anchors(
    cables: CableSet, above: tuple[bool, bool], below: tuple[bool, bool], crossed: bool
) -> CableSet:
    """The fully constrained ACROBOT's cables on other anchor points of the same platform.

    Args:
        cables: Its cables.
        above: Whether cables from above hold a corner with the other sign than that of their exit
            point along x, and along y.
        below: The same of cables from the floor.
        crossed: Whether cables from the floor hold the upper points.
    """
    x, y, z = cables.p_PB
    high = cables.p_WA[2] > np.mean(cables.p_WA[2])
    side, front, _ = np.sign(cables.p_WA)
    signs = [np.where(np.where(high, a, b), -1.0, 1.0) for a, b in zip(above, below, strict=True)]
    heights = np.where(high ^ crossed, z.max(), z.min())
    return replace(
        cables,
        p_PB=np.stack([signs[0] * side * np.abs(x), signs[1] * front * np.abs(y), heights]),
    )


def exchanged_anchors(cables: CableSet, one: int, other: int) -> CableSet:
    """Cables of which two hold each other's anchor point; the same number twice changes nothing."""
    order = np.arange(cables.count)
    order[[one, other]] = other, one
    return replace(cables, p_PB=cables.p_PB[:, order])


FILE = load_yaml(Path(__file__).with_name("recipes.yaml").read_text(encoding="utf-8"))

CHOICES: tuple[Mapping[str, str], ...] = tuple(FILE["choices"])
"""What was chosen: what, text: what the thesis says of it, chosen, rows: with which rows in sight.
Not recorded: which single rows of the tables that are not in `FITTED_TABLES` were at hand, too."""

FITTED_TABLES = ("A.8", "A.10", "A.11", "A.12", "A.14", "A.15", "A.17")
"""Tables all of whose rows were in sight when the recipe was chosen."""

RECIPES = {
    entry["name"]: Recipe(**{**entry, "view": View(**entry.get("view", {}))})
    for entry in FILE["recipes"]
}
"""All of them, by name."""

PRESENT = RECIPES["present"]

EXCHANGED_CABLES = RECIPES["one-exchange"]
"""The recipe with EXCHANGED."""

IN_USE = EXCHANGED_CABLES
"""The recipe of all studies that do not ask for another one."""

OTHER_ANCHORS = (
    "upper-on-upper", "other-corners-independent", "lower-on-upper-independent", "one-exchange",
)  # fmt: skip
"""Recipes with other anchor points of the fully constrained ACROBOT that are held against what any
target leaves."""
