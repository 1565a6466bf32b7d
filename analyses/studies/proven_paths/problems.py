"""Problems of the study: walls, pillars and shelves in the frames of robots, poses by chance.

Starts and goals are drawn by a seed among the poses that the exact checks accept, whose straight
line they do not. Paths and motions are judged by the exact checks of poses, and not by the sets.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from cdpr_drake.analyses.planning.robot_path_task import RESERVE, LimitSettings, path_task
from cdpr_drake.analyses.workspaces.proven_sets import ProofSettings, ProvenSets
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError, PlanningError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.workspaces.cable_interference import box_row

ROBOTS = {"caroca": 0.1, "macarm": 1.0, "ipanema_1": 0.5}
"""Robots, and the half width of the box of accelerations that is proven [m/s^2]. Suspended ones
give little; the last two have cables from below, too."""

SCENES = ("wall", "pillars", "shelf")

PROBLEMS = {
    "caroca": (3, 3, 2), "macarm": (2, 2, 2), "ipanema_1": (2, 2, 2),
}  # fmt: skip
"""Problems with the wall, the pillars and the shelf."""

SEED = 1
"""Of the poses; each scene adds its place in `SCENES`."""

FARTHEST = 0.25
"""Starts and goals are farther apart than this share of the frame's diagonal."""

ROOM = 0.02
"""Starts and goals hold so far round, too, as a share of the frame."""

DRAWN = 6000
"""Poses that are drawn for a scene."""

LOOKS = 200
"""Samples of a straight line."""

ROUGH_BOXES, ROUGH_CELLS = 2000, 2**12
"""Of sets that starts and goals are drawn with, where only the exact checks matter."""


@dataclass(frozen=True)
class Spec:
    """Which problem.

    Attributes:
        robot: Name of the robot.
        scene: One of `SCENES`.
        number: Of those of the scene, from 1.
    """

    robot: str
    scene: str
    number: int

    @property
    def name(self) -> str:
        """Its words."""
        return f"{self.robot} {self.scene} {self.number}"


SPECS = tuple(
    Spec(robot, scene, number)
    for robot, counts in PROBLEMS.items()
    for scene, count in zip(SCENES, counts, strict=True)
    for number in range(1, count + 1)
)
"""All problems."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot among obstacles.

    Attributes:
        robot: The robot.
        task: Its limits.
        boxes: Obstacles, shape (o, 15).
        judges: Sets that know the exact checks.
        ends: Starts and goals of its problems, shape (6,) each [m, rad].
    """

    robot: Robot
    task: PathTask
    boxes: Array
    judges: ProvenSets
    ends: tuple[tuple[Array, Array], ...]

    def good(self, positions: Array, rotations: Array | None = None) -> np.ndarray:
        """Whether all kinds hold by the exact checks, shape (n,); None: without turns."""
        if rotations is None:
            rotations = np.repeat(np.eye(3)[np.newaxis], len(positions), axis=0)
        return np.all(np.array(list(self.judges.judge(positions, rotations).values())), axis=0)

    def wrong(self, positions: Array, rotations: Array | None = None) -> int:
        """At how many of some poses a kind does not hold."""
        return int(np.count_nonzero(~self.good(positions, rotations)))


def scene_boxes(robot: Robot, scene: str) -> Array:
    """Obstacles by shares of a robot's frame, shape (o, 15)."""
    low, high = robot.reach()
    size = high - low
    shares = {
        "wall": [((0.5, 0.5, 0.15), (0.04, 0.35, 0.3))],
        "pillars": [((0.42, 0.42, 0.18), (0.05, 0.05, 0.36)),
                    ((0.58, 0.6, 0.18), (0.05, 0.05, 0.36))],
        "shelf": [((0.5, 0.5, 0.27), (0.3, 0.15, 0.02)), ((0.36, 0.5, 0.13), (0.02, 0.15, 0.26)),
                  ((0.64, 0.5, 0.13), (0.02, 0.15, 0.26))],
    }  # fmt: skip
    return np.array(
        [box_row(low + np.array(m) * size, np.array(s) * size) for m, s in shares[scene]]
    )


def proof_settings(task: PathTask, boxes: int, cells: int) -> ProofSettings:
    """How sets are proven for the tensions of a task."""
    return ProofSettings(boxes=boxes, cells=cells, limits=(task.limits.lower, task.limits.upper))


@lru_cache(maxsize=1)
def scene_of(robot: str, scene: str) -> Scene:
    """A scene with the ends of its problems; the last one is kept.

    Raises:
        PlanningError: Fewer problems than `PROBLEMS` says were found.
    """
    loaded = load_robot(robot)
    task = path_task(loaded, LimitSettings(reserve=RESERVE))
    boxes, place = scene_boxes(loaded, scene), SCENES.index(scene)
    judges = ProvenSets.find(
        loaded, None, None, boxes, ROBOTS[robot],
        settings=proof_settings(task, ROUGH_BOXES, ROUGH_CELLS),
    )  # fmt: skip
    alone = Scene(loaded, task, boxes, judges, ())
    count = PROBLEMS[robot][place]
    ends = _drawn_ends(alone, count, SEED + place)
    if len(ends) < count:
        raise PlanningError(
            f"{robot}, {scene}: found {len(ends)} problems of {DRAWN} poses; accepted: {count}"
        )
    return Scene(loaded, task, boxes, judges, ends)


def _drawn_ends(scene: Scene, count: int, seed: int) -> tuple[tuple[Array, Array], ...]:
    """Pairs of poses that hold, far apart, whose straight line does not hold."""
    low, high = scene.robot.reach()
    random = np.random.default_rng(seed)
    places = random.uniform(low, high, (DRAWN, 3))
    corners = np.array([np.zeros(3), *product((-1.0, 1.0), repeat=3)])
    for corner in corners:
        places = places[scene.good(places + ROOM * corner * (high - low))]
    found: list[tuple[Array, Array]] = []
    for a, b in zip(places[0::2], places[1::2], strict=False):
        if np.linalg.norm(b - a) < FARTHEST * np.linalg.norm(high - low):
            continue
        line = a + np.linspace(0.0, 1.0, LOOKS)[:, np.newaxis] * (b - a)
        if not np.all(scene.good(line)):
            found.append((np.append(a, np.zeros(3)), np.append(b, np.zeros(3))))
        if len(found) == count:
            break
    return tuple(found)


@lru_cache(maxsize=1)
def sets_of(robot: str, scene: str, boxes: int, cells: int) -> tuple[ProvenSets, float]:
    """Sets for all problems of a scene, and the processor time that they took [s]."""
    found = scene_of(robot, scene)
    return proven_sets(found, [pose for pair in found.ends for pose in pair], boxes, cells)


def proven_sets(
    scene: Scene, must: Sequence[Array], boxes: int, cells: int
) -> tuple[ProvenSets, float]:
    """Sets among which some poses are, if they can be proven; and processor time [s]."""
    settings = proof_settings(scene.task, boxes, cells)
    asked = (scene.robot, None, None, scene.boxes, ROBOTS[scene.robot.name])
    begin = time.process_time()
    try:
        sets = ProvenSets.find(*asked, settings=settings, must=list(must))
    except CdprError:  # a pose at the very border: without those that must be in
        sets = ProvenSets.find(*asked, settings=settings)
    return sets, time.process_time() - begin
