"""Robot files of designs: points moved, some as images of others, cables left out, drum and motor
changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cdpr_drake.analyses.design.settings import AXES, DesignSettings
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.schema.yaml_files import load_yaml

LEAST_CABLES, MOST_CABLES = 4, 8

WINCH = ("drum_radius", "gear_ratio", "motor_torque")


@dataclass(frozen=True)
class Mirror:
    """Point `second` moves as the image of point `first` does, in a plane or by half a turn.

    Attributes:
        axes: Along which displacements change their sign: one, the normal of a plane, or two, half
            a turn about the third.
        first: Number of a point.
        second: Number of another; or of the same, which then does not move along these axes.
    """

    axes: tuple[int, ...]
    first: int
    second: int


class MovedPoints:
    """Displacements of points as functions of few coordinates in [0, 1].

    Every coordinate of every point is free, or tied to that of another with the same sign or the
    opposite one. Where ties contradict each other, the coordinate does not move. Half a box is the
    least among those that are tied.
    """

    def __init__(self, reach: Array, mirrors: Sequence[Mirror] = ()) -> None:
        """For points that move by at most `reach`, shape (3, m), >= 0 [m], either way."""
        self.reach = np.asarray(reach, float)
        m = self.reach.shape[1]
        parent, sign, still = list(range(3 * m)), [1.0] * (3 * m), set[int]()

        def root(k: int) -> tuple[int, float]:
            total = 1.0
            while parent[k] != k:
                total *= sign[k]
                k = parent[k]
            return k, total

        for mirror in mirrors:
            for axis in range(3):
                opposite = -1.0 if axis in mirror.axes else 1.0
                a, s = root(3 * mirror.first + axis)
                b, t = root(3 * mirror.second + axis)
                if a != b:
                    parent[b], sign[b] = a, s * opposite * t
                elif s * opposite != t:
                    still.add(a)
        still = {root(k)[0] for k in still}
        groups: dict[int, list[tuple[int, float]]] = {}
        for k in range(3 * m):
            first, s = root(k)
            groups.setdefault(first, []).append((k, s))
        columns = []
        for first, members in groups.items():
            half = min(self.reach[k % 3, k // 3] for k, _ in members)
            if first in still or half <= 0.0:
                continue
            column = np.zeros(3 * m)
            for k, s in members:
                column[k] = s * half
            columns.append(column.reshape(m, 3).T)
        self._columns = np.array(columns).reshape(-1, 3, m)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self._columns)

    def displacements(self, coordinates: Array) -> Array:
        """Displacements, shape (3, m) [m]; those of coordinates of 0.5 are zero."""
        return np.tensordot(2.0 * np.asarray(coordinates) - 1.0, self._columns, 1)

    def slopes(self, by_points: Array) -> Array:
        """Slopes by the coordinates, shape (n, size), of functions with slopes by the points, shape
        (n, 3, m) [1/m]."""
        return np.asarray(2.0 * np.einsum("nam,kam->nk", by_points, self._columns))


@dataclass(frozen=True, eq=False)
class Candidates:
    """The designs that a robot may become; pickles.

    Attributes:
        present: The robot as it is.
        text: Its robot file.
        cable_sets: Sets of cables, by number, each of which is tried.
        points: Moves of its exit points, then of its anchor points, all cables, tied together.
        ranges: Least and largest value of winch fields by name.
    """

    present: Robot
    text: str
    cable_sets: tuple[tuple[int, ...], ...]
    points: MovedPoints
    ranges: dict[str, tuple[float, float]]

    @property
    def size(self) -> int:
        """Coordinates of a design."""
        return self.points.size + len(self.ranges)

    def robot_text(self, number: int, coordinates: Array, title: str = "") -> str:
        """The robot file of a design, of the set of cables with a number."""
        content: dict[str, Any] = load_yaml(self.text)
        moved = self.points.displacements(coordinates[: self.points.size])
        m = len(content["cables"])
        for k, cable in enumerate(content["cables"]):
            for key, column in (("exit_point", k), ("anchor_point", m + k)):
                cable[key] = (np.array(cable[key], float) + moved[:, column]).tolist()
        content["cables"] = [content["cables"][k] for k in self.cable_sets[number]]
        if len(content["cables"]) < m and content.get("slack_readings"):
            readings = content["slack_readings"]
            content["slack_readings"] = [readings[k] for k in self.cable_sets[number]]
        winch = content["winch"]
        for (name, (low, high)), share in zip(
            self.ranges.items(), coordinates[self.points.size :], strict=True
        ):
            winch[name] = float(low * (high / low) ** share)
        if self.ranges:
            pull = winch["motor_torque"] * winch["gear_ratio"] / winch["drum_radius"]
            content["tension_bounds"]["upper"] = float(pull)
        if title:
            content["title"] = title
        return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True))

    def robot(self, number: int, coordinates: Array) -> Robot:
        """The robot of a design.

        Raises:
            RobotFileError: It is none that can be.
        """
        return parse_robot(self.robot_text(number, coordinates), Path("design"))


def make_candidates(
    robot_name: str, settings: DesignSettings, source: str = "design"
) -> Candidates:
    """The designs that a robot may become.

    Args:
        robot_name: Robot by name, or path of a robot file.
        settings: What may change.
        source: Words for messages: the file of the settings.

    Raises:
        CdprError: A cable is unknown, a range empty, nothing may change, or the robot cannot be.
    """
    robot = load_robot(robot_name)
    names = [cable.name for cable in robot.cables]
    m = len(names)

    def refuse(where: str, words: str) -> DesignError:
        return DesignError(f"{source}: {where}: {words}")

    def numbers(chosen: Sequence[str], where: str) -> list[int]:
        for name in chosen:
            if name not in names:
                raise refuse(where, f"{name!r} is unknown; {closest(name, names)}")
        return [names.index(name) for name in chosen]

    half = np.zeros((3, 2 * m))
    for first, moved, where in (
        (0, settings.exit_points, "exit_points.cables"),
        (m, settings.anchor_points, "anchor_points.cables"),
    ):
        chosen = numbers(moved.cables, where) or range(m)
        half[:, [first + k for k in chosen]] = moved.reach[:, np.newaxis]
    if robot.is_planar() and np.any(half[2] > 0.0):
        raise refuse("exit_points.reach, anchor_points.reach", "found moves along z of the planar "
                     f"{robot.name}; accepted: 0 along z")  # fmt: skip
    mirrors = []
    for k, mirror in enumerate(settings.mirrors):
        where = f"mirrors[{k}].pairs"
        for pair in mirror.pairs:
            if "-" not in pair:
                raise refuse(where, f"found {pair!r}; accepted: such as C1-C4")
            a, b = numbers([name.strip() for name in pair.split("-", 1)], where)
            axes = AXES[mirror.axis]
            mirrors += [Mirror(axes, a, b), Mirror(axes, m + a, m + b)]
    cable_sets = []
    for k, words in enumerate(settings.cables):
        chosen = numbers([name.strip() for name in words.split(",")], f"cables[{k}]")
        if not LEAST_CABLES <= len(set(chosen)) == len(chosen) <= MOST_CABLES:
            raise refuse(f"cables[{k}]", f"found {words!r}; accepted: {LEAST_CABLES} to "
                         f"{MOST_CABLES} different cables")  # fmt: skip
        cable_sets.append(tuple(sorted(chosen)))
    ranges = {
        name: (float(values[0]), float(values[1]))
        for name in WINCH
        if (values := getattr(settings.winch, name)) is not None
    }
    for name, (low, high) in ranges.items():
        if not low < high:
            raise refuse(f"winch.{name}", f"found {low:g} to {high:g}; accepted: least < largest")
    if ranges and robot.winch.motor_torque is None and "motor_torque" not in ranges:
        raise refuse("winch", f"found no motor_torque of {robot.name}, from which tensions follow; "
                     "accepted: a range of it")  # fmt: skip
    candidates = Candidates(
        robot, robot_text(robot_name), tuple(cable_sets) or (tuple(range(m)),),
        MovedPoints(half, mirrors), ranges,
    )  # fmt: skip
    if candidates.size == 0 and len(candidates.cable_sets) < 2:
        raise DesignError(
            f"{source}: found nothing that may change; accepted: a reach above 0, ranges of the "
            "winch, or several sets of cables"
        )
    return candidates
