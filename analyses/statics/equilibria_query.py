"""All poses at which a robot rests: for given lengths, or at a given position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics.equilibria_at_position import enumerate_at_position
from cdpr_drake.statics.equilibrium import Stability
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_search import sample_equilibria
from cdpr_drake.statics.inextensible_problem import EquilibriumPose, HangingPlatform
from cdpr_drake.statics.real_solutions import PathCount
from cdpr_drake.summaries import Summarized, numbers

FIXED = "pulleys ignored: all poses are found for cables from fixed exit points only"
"""Geometry of poses that are enumerated, for a robot with pulleys."""

Report = Callable[[int, int], object]

SHOWN = 6
"""So many poses are shown where the report shows itself."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class EquilibriaReport(Summarized):
    """Poses of rest of a robot.

    Attributes:
        robot: Its name.
        names: Names of the cables.
        model: `inextensible` or `elastic`.
        pulleys: Whether the cables run over pulleys.
        geometry: Geometry of the cables, as `Robot.geometry_words`, and why.
        lengths: Given lengths, shape (m,) [m]; None where a position was given.
        rests: The poses, the lowest energy first.
        needed: Lengths of the cables at each, shape (m,) [m]; of slack ones the straight path.
        evidence: What tells whether poses are missing.
        words: The same in a line.
    """

    robot: str
    names: list[str]
    model: str
    pulleys: bool
    geometry: str
    lengths: Array | None
    rests: list[EquilibriumPose]
    needed: list[Array]
    evidence: dict[str, Any]
    words: str

    def as_dict(self) -> dict[str, Any]:
        """The report for JSON; what is infinite or does not apply is null."""
        return {
            "robot": self.robot,
            "cable_model": self.model,
            "pulleys": self.pulleys,
            "geometry": self.geometry,
            "lengths_m": None if self.lengths is None else self.lengths.tolist(),
            "evidence": self.evidence,
            "equilibria": [
                _rest(one, needed) for one, needed in zip(self.rests, self.needed, strict=True)
            ],
        }

    def summary(self) -> tuple[str, list[tuple[str, str]]]:
        """What it shows of itself: the first poses, the lowest energy first."""
        count = len(self.rests)
        stable = sum(one.stability == Stability.STABLE for one in self.rests)
        title = f"{self.robot}: {count} pose{'s' * (count != 1)} of rest, {stable} stable"
        rows = [
            (str(one.stability), f"({numbers(one.X_WP.translation())}) m, {one.energy:.5g} J")
            for one in self.rests[:SHOWN]
        ]
        if count > SHOWN:
            rows.append(("...", f"{count - SHOWN} more"))
        return title, [
            ("cables", self.model), ("geometry", self.geometry), ("evidence", self.words), *rows,
        ]  # fmt: skip


def hanging_platform(robot: Robot, *, pulleys: bool) -> HangingPlatform:
    """The robot's platform on its cables, for all its equilibria; over pulleys or without.

    Raises:
        EquilibriumError: The platform is a beam, whose turn about itself does not count.
    """
    motion, home = robot.motion_type(), robot.home.transform()
    return HangingPlatform(
        cables=robot.cable_set(pulleys),
        weight_W=robot.platform.mass * robot.gravity_vector(),
        p_PCo=robot.center_of_mass(),
        num_turns=motion.num_turns,
        num_moves=motion.num_moves,
        axis=motion.axis,
        home=robot.joint().nearest(home),
    )


def equilibria_at_lengths(
    robot: Robot, lengths: Array, *, report: Report | None = None
) -> EquilibriaReport:
    """All poses of rest on inextensible cables from fixed exit points.

    Args:
        robot: The robot, of 1 to 8 cables.
        lengths: Shape (m,) [m].
        report: Called with work done and in all.

    Raises:
        EquilibriumError: No pose has these lengths, or the platform has no weight.
    """
    platform = hanging_platform(robot, pulleys=False)
    found = enumerate_equilibria(platform, lengths, report)
    evidence, words = _counted(found.paths)
    evidence["taut_sets"] = found.sets
    given = np.asarray(lengths, float)
    return _report(robot, platform, found.rests, given, evidence, words)


def elastic_equilibria(
    robot: Robot,
    l0: Array,
    pulleys: bool,
    *,
    searches: int,
    seed: int,
    report: Report | None = None,
) -> EquilibriaReport:
    """Poses of rest on straight elastic cables, searched from random poses.

    Args:
        robot: The robot, of 1 to 8 cables.
        l0: Unstrained lengths, shape (m,) [m].
        pulleys: Whether cables run over the robot's pulleys.
        searches: Most searches.
        seed: Of the random poses.
        report: Called with work done and in all.

    Raises:
        EquilibriumError: None was found, or numbers are not accepted.
    """
    platform = hanging_platform(robot, pulleys=pulleys)
    home = [platform.home]
    found = sample_equilibria(platform, l0, most=searches, seed=seed, starts=home, report=report)
    evidence = {
        "method": "multi-start",
        "complete": False,
        "searches": found.searches,
        "ended_at_rest": found.ended,
        "expected_in_all": found.expected if np.isfinite(found.expected) else None,
        "covered_share_of_starts": found.covered,
        "stopped_by_rule": found.stopped,
        "seed": seed,
    }
    words = f"{found.searches} searches, {found.ended} ended at rest; not proven to be all"
    if np.isfinite(found.expected):
        words += f": {found.expected:.1f} expected"
    if not found.stopped:
        words += "; the stopping rule asks for more searches"
    given = np.asarray(l0, float)
    return _report(robot, platform, found.rests, given, evidence, words, model="elastic")


def equilibria_with_position(robot: Robot, p_WP: Array, taut: list[int]) -> EquilibriaReport:
    """All poses of rest with Po at a position, on some cables, from fixed exit points.

    Args:
        robot: The robot.
        p_WP: Position, shape (3,) [m].
        taut: Numbers of the cables that hold it.

    Raises:
        EquilibriumError: There is none, or the request makes no sense.
    """
    platform = hanging_platform(robot, pulleys=False)
    found = enumerate_at_position(platform, p_WP, taut)
    evidence, words = _counted(found.paths)
    evidence["taut"] = [robot.cables[i].name for i in taut]
    return _report(robot, platform, found.rests, None, evidence, words)


def _counted(paths: PathCount) -> tuple[dict[str, Any], str]:
    evidence = {
        "method": "all complex solutions along paths, and closed forms",
        "complete": paths.lost == 0,
        "systems": paths.systems,
        "paths": paths.paths,
        "to_infinity": paths.away,
        "to_singular_solutions": paths.singular,
        "lost": paths.lost,
    }
    if paths.lost:
        words = f"{paths.lost} of {paths.paths} paths lost: poses may be missing"
    elif paths.paths:
        words = f"all {paths.paths} paths to complex solutions ended: no isolated pose is missing"
    else:
        words = "closed form: no pose is missing"
    if paths.singular and not paths.lost:
        words += f", but where solutions meet ({paths.singular})"
    return evidence, words


def _report(
    robot: Robot,
    platform: HangingPlatform,
    rests: list[EquilibriumPose],
    lengths: Array | None,
    evidence: dict[str, Any],
    words: str,
    *,
    model: str = "inextensible",
) -> EquilibriaReport:
    over = platform.cables.has_pulleys()
    geometry = robot.geometry_words(over)
    if robot.cable_set().has_pulleys() and not over and model == "inextensible":
        geometry = FIXED
    needed = [cable_paths(one.X_WP, platform.cables).lengths for one in rests]
    return EquilibriaReport(
        robot=robot.name, names=[cable.name for cable in robot.cables], model=model,
        pulleys=over, geometry=geometry, lengths=lengths, rests=rests, needed=needed,
        evidence=evidence, words=words,
    )  # fmt: skip


def _rest(one: EquilibriumPose, needed: Array) -> dict[str, Any]:
    return {
        "pose": _pose(one.X_WP),
        "stability": str(one.stability),
        "certificate": str(one.certificate),
        "unique_within_m": one.radius,
        "one_of_a_family": one.family,
        "tensions_n": one.tensions.tolist(),
        "slack": one.slack.tolist(),
        "path_lengths_m": needed.tolist(),
        "energy_j": one.energy,
        "unbalanced_n": one.unbalanced,
        "principal_stiffnesses_n_per_m": [
            float(value) if np.isfinite(value) else None for value in one.stiffnesses
        ],
    }


def _pose(X_WP: RigidTransform) -> dict[str, list[float]]:
    angles = np.degrees(angles_from_rotation(X_WP.rotation()))
    return {"position_m": X_WP.translation().tolist(), "angles_deg": angles.tolist()}
