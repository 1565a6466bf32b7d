"""Robot files of designs: points moved, cables left out, drum and motor changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from cdpr_drake.analyses.design.moved_points import AXES, Mirror, MovedPoints
from cdpr_drake.analyses.design.settings import DesignSettings, MovedSettings
from cdpr_drake.arrays import Array
from cdpr_drake.errors import DesignError
from cdpr_drake.models.robot_loader import load_robot, parse_robot, robot_text
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.typed_yaml import closest
from cdpr_drake.schema.yaml_files import load_yaml

LEAST_CABLES, MOST_CABLES = 4, 8

WINCH = ("drum_radius", "gear_ratio", "motor_torque")


@dataclass(frozen=True, eq=False)
class Candidates:
    """The designs that a robot may become; pickles.

    Attributes:
        text: Its robot file.
        kept: Sets of cables, by number, each of which is tried.
        points: Moves of its exit points, then of its anchor points, all cables, tied together.
        ranges: Least and largest value of winch fields by name.
    """

    text: str
    kept: tuple[tuple[int, ...], ...]
    points: MovedPoints
    ranges: dict[str, tuple[float, float]]

    @property
    def size(self) -> int:
        """Coordinates of a design."""
        return self.points.size + len(self.ranges)

    def robot_text(self, number: int, coordinates: Array, title: str = "") -> str:
        """The robot file of a design, of the set of cables with a number."""
        found: dict[str, Any] = load_yaml(self.text)
        moved = self.points.displacements(coordinates[: self.points.size])
        m = len(found["cables"])
        for k, cable in enumerate(found["cables"]):
            for key, column in (("exit_point", k), ("anchor_point", m + k)):
                cable[key] = (np.array(cable[key], float) + moved[:, column]).tolist()
        found["cables"] = [found["cables"][k] for k in self.kept[number]]
        if len(found["cables"]) < m and found.get("slack_readings"):
            readings = found["slack_readings"]
            found["slack_readings"] = [readings[k] for k in self.kept[number]]
        winch = found["winch"]
        for (name, (low, high)), share in zip(
            self.ranges.items(), coordinates[self.points.size :], strict=True
        ):
            winch[name] = float(low * (high / low) ** share)
        if self.ranges:
            pull = winch["motor_torque"] * winch["gear_ratio"] / winch["drum_radius"]
            found["tension_bounds"]["upper"] = float(pull)
        if title:
            found["title"] = title
        return str(yaml.safe_dump(found, sort_keys=False, allow_unicode=True))

    def robot(self, number: int, coordinates: Array) -> Robot:
        """The robot of a design.

        Raises:
            RobotFileError: It is none that can be.
        """
        return parse_robot(self.robot_text(number, coordinates), Path("design"))


def make_candidates(robot_name: str, settings: DesignSettings, source: str) -> Candidates:
    """What a robot may become.

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

    def number(name: str, where: str) -> int:
        if name not in names:
            raise DesignError(f"{source}: {where}: {name!r} is unknown; {closest(name, names)}")
        return names.index(name)

    def reach(moved: MovedSettings, where: str) -> Array:
        chosen = [number(name, f"{where}.cables") for name in moved.cables] or range(m)
        half = np.zeros((3, m))
        half[:, list(chosen)] = moved.reach[:, np.newaxis]
        return half

    half = np.hstack(
        [reach(settings.exit_points, "exit_points"), reach(settings.anchor_points, "anchor_points")]
    )
    if robot.is_planar() and np.any(half[2] > 0.0):
        raise DesignError(
            f"{source}: exit_points.reach, anchor_points.reach: found moves along z of the planar "
            f"{robot.name}; accepted: 0 along z"
        )
    mirrors = []
    for k, mirror in enumerate(settings.mirrors):
        where, axes = f"mirrors[{k}].pairs", AXES[mirror.axis]
        for pair in mirror.pairs:
            one, dash, other = pair.partition("-")
            if not dash:
                raise DesignError(f"{source}: {where}: found {pair!r}; accepted: such as C1-C4")
            a, b = number(one.strip(), where), number(other.strip(), where)
            mirrors += [Mirror(axes, a, b), Mirror(axes, m + a, m + b)]
    kept = _kept(settings.cables, names, source)
    ranges = _ranges(robot, settings, source)
    found = Candidates(robot_text(robot_name), kept, MovedPoints(half, mirrors), ranges)
    if found.size == 0 and len(kept) < 2:
        raise DesignError(
            f"{source}: found nothing that may change; accepted: a reach above 0, ranges of the "
            "winch, or several sets of cables"
        )
    return found


def _kept(sets: Sequence[str], names: list[str], source: str) -> tuple[tuple[int, ...], ...]:
    found = []
    for k, words in enumerate(sets):
        chosen = [word.strip() for word in words.split(",")]
        for name in chosen:
            if name not in names:
                raise DesignError(
                    f"{source}: cables[{k}]: {name!r} is unknown; {closest(name, names)}"
                )
        if not LEAST_CABLES <= len(set(chosen)) == len(chosen) <= MOST_CABLES:
            raise DesignError(
                f"{source}: cables[{k}]: found {words!r}; accepted: {LEAST_CABLES} to "
                f"{MOST_CABLES} different cables"
            )
        found.append(tuple(sorted(names.index(name) for name in chosen)))
    return tuple(found) or (tuple(range(len(names))),)


def _ranges(robot: Robot, settings: DesignSettings, source: str) -> dict[str, tuple[float, float]]:
    ranges = {}
    for name in WINCH:
        values = getattr(settings.winch, name)
        if values is None:
            continue
        low, high = (float(value) for value in values)
        if not low < high:
            raise DesignError(
                f"{source}: winch.{name}: found {low:g} to {high:g}; accepted: least < largest"
            )
        ranges[name] = (low, high)
    if ranges and robot.winch.motor_torque is None and "motor_torque" not in ranges:
        raise DesignError(
            f"{source}: winch: found no motor_torque of {robot.name}, from which tensions follow; "
            "accepted: a range of it"
        )
    return ranges
