"""All poses at which a robot rests: for given lengths, or at a given position."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from cyclopts import Parameter

from cdpr_drake.analyses.frame.follow import NOBODY, Follow, Progress
from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import Names, Numbers, RobotWord, Vector, one_of
from cdpr_drake.analyses.kinematics import checked_lengths, pose_numbers
from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError, StoppedError, accepted_names
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics.equilibria_at_position import enumerate_at_position
from cdpr_drake.statics.equilibrium import Stability
from cdpr_drake.statics.equilibrium_enumeration import enumerate_equilibria
from cdpr_drake.statics.equilibrium_search import sample_equilibria
from cdpr_drake.statics.inextensible_problem import EquilibriumPose, HangingPlatform
from cdpr_drake.summaries import numbers

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INEXTENSIBLE, ELASTIC = "inextensible", "elastic"
"""Cable models of `find_equilibria`."""

FIXED = "pulleys ignored: all poses are found for cables from fixed exit points only"
"""Geometry of poses that are enumerated, for a robot with pulleys."""

DRAWN = 6
"""Most poses in the figure."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Equilibria(Result):
    """Poses of rest of a robot.

    Attributes:
        robot: The robot.
        model: `inextensible` or `elastic`.
        platform: The platform on its cables.
        lengths: Given lengths, shape (m,) [m]; None where a position was given.
        rests: The poses, the lowest energy first.
        evidence: Numbers that tell whether poses are missing.
    """

    robot: Robot
    model: str
    platform: HangingPlatform
    lengths: Array | None
    rests: Sequence[EquilibriumPose]
    evidence: dict[str, Any]

    @property
    def geometry(self) -> str:
        """Geometry of the cables, as `Robot.geometry_words`, and why."""
        if self.model == INEXTENSIBLE and self.robot.cable_set().has_pulleys():
            return FIXED
        return self.robot.geometry_words(self.platform.cables.has_pulleys())

    def path_lengths(self) -> list[Array]:
        """Lengths of the cables at each pose, shape (m,) [m]; of slack cables the straight path."""
        return [cable_paths(rest.X_WP, self.platform.cables).lengths for rest in self.rests]

    def as_dict(self) -> dict[str, Any]:
        """For JSON; what is infinite or does not apply is null."""
        return {
            "robot": self.robot.name,
            "cable_model": self.model,
            "pulleys": self.platform.cables.has_pulleys(),
            "geometry": self.geometry,
            "lengths_m": None if self.lengths is None else self.lengths.tolist(),
            "evidence": self.evidence,
            "equilibria": [
                {
                    "pose": pose_numbers(rest.X_WP),
                    "stability": str(rest.stability),
                    "certificate": str(rest.certificate),
                    "unique_within_m": rest.radius,
                    "one_of_a_family": rest.family,
                    "tensions_n": rest.tensions.tolist(),
                    "slack": rest.slack.tolist(),
                    "path_lengths_m": lengths.tolist(),
                    "energy_j": rest.energy,
                    "unbalanced_n": rest.unbalanced,
                    "principal_stiffnesses_n_per_m": [
                        float(value) if np.isfinite(value) else None for value in rest.stiffnesses
                    ],
                }
                for rest, lengths in zip(self.rests, self.path_lengths(), strict=True)
            ],
        }

    def tables(self) -> list[Table]:
        """A row for each pose, the lowest energy first."""
        count, by_position = len(self.rests), self.lengths is None
        stable = sum(rest.stability == Stability.STABLE for rest in self.rests)
        title = (
            f"{self.robot.name}: {count} pose{'s' * (count != 1)} of rest, {stable} stable, "
            f"{self.model} cables, {self.geometry}"
        )
        names, rows = [cable.name for cable in self.robot.cables], []
        for rest, lengths in zip(self.rests, self.path_lengths(), strict=True):
            tensions = ", ".join(
                f"{name} {tension:.4g}"
                for name, tension in zip(names, rest.tensions, strict=True) if tension > 0.0
            )  # fmt: skip
            certificate = str(rest.certificate)
            if rest.radius is not None:
                certificate += f", alone within {1e3 * rest.radius:.2g} mm"
            rows.append((
                numbers(rest.X_WP.translation(), 5),
                numbers(np.degrees(angles_from_rotation(rest.X_WP.rotation()))),
                str(rest.stability), f"{rest.energy:.5g}", tensions,
                *([numbers(lengths, 5)] if by_position else []),
                certificate + ", one of a family" * rest.family,
            ))  # fmt: skip
        return [Table(title, (
            "position [m]", "angles [deg]", "stability", "energy [J]", "tensions [N]",
            *(["lengths [m]"] if by_position else []), "certificate",
        ), rows)]  # fmt: skip

    def lines(self) -> list[str]:
        """The evidence."""
        evidence = self.evidence
        if self.model == ELASTIC:
            words = (
                f"{evidence['searches']} searches, {evidence['ended_at_rest']} ended at rest; not "
            )
            words += "proven to be all"
            if evidence["expected_in_all"] is not None:
                words += f": {evidence['expected_in_all']:.1f} expected"
            if not evidence["stopped_by_rule"]:
                words += "; the stopping rule asks for more searches"
        elif evidence["lost"]:
            words = f"{evidence['lost']} of {evidence['paths']} paths lost: poses may be missing"
        else:
            words = "closed form: no pose is missing"
            if evidence["paths"]:
                words = (
                    f"all {evidence['paths']} paths to complex solutions ended: no isolated pose "
                )
                words += "is missing"
            if evidence["to_singular_solutions"]:
                words += f", but where solutions meet ({evidence['to_singular_solutions']})"
        return ["cables without a tension are slack; " + words]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The robot at its `DRAWN` lowest poses of rest; slack cables are dotted."""
        from cdpr_drake.analyses.visualization.path_figures import poses_figure

        lowest = self.rests[:DRAWN]
        poses = {f"{k + 1}: {rest.stability}": rest.X_WP for k, rest in enumerate(lowest)}
        what = f"{len(self.rests)} poses of rest, {self.model} cables, {self.geometry}"
        slack = [np.asarray(rest.tensions) <= 0.0 for rest in lowest]
        title = f"{self.robot.name}: {what}"
        return {"poses": lambda: poses_figure(title, self.robot, poses, slack)}


@verb()
def find_equilibria(
    robot: RobotWord, lengths: Numbers = None, position: Vector = None, *,
    taut: Names | None = None,
    model: Annotated[str, one_of((INEXTENSIBLE, ELASTIC), "--cable-model")] = INEXTENSIBLE,
    pulleys: bool = True, searches: int = 1000, seed: int = 0,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Equilibria:  # fmt: skip
    """Finds all poses of rest, stable or not, with any cables slack, for lengths or a position.

    Args:
        robot: Robot by name or file, of 1 to 8 cables.
        lengths: Cable lengths from A to B, of elastic cables unstrained ones, l1,...,lm [m].
        position: Instead of lengths: position of the platform, x,y,z [m].
        taut: Names of the cables that hold the platform at the position, all others are slack;
            default: all.
        model: inextensible: all poses, from fixed exit points; elastic: searched.
        pulleys: Take the robot's pulleys into account, for elastic cables; inextensible cables
            always ignore them.
        searches: Largest number of searches, for elastic cables.
        seed: Seed of the random starts, for elastic cables.
        follow: Follows the searches; no number depends on it.

    Raises:
        EquilibriumError: There is none, or an argument is not accepted; names it.
        StoppedError: The search was stopped.
    """
    if (position is None) == (lengths is None):
        count = "neither" if position is None else "both"
        raise EquilibriumError(f"lengths, position: found {count}; accepted: one of them")
    if taut is not None and position is None:
        raise EquilibriumError("taut: found without position; accepted: with it")
    if model not in (INEXTENSIBLE, ELASTIC):
        raise EquilibriumError(
            f"model: found {model!r}; {accepted_names(model, (INEXTENSIBLE, ELASTIC))}"
        )
    if searches < 1:
        raise EquilibriumError(f"searches: found {searches}; accepted: at least 1")
    if seed < 0:
        raise EquilibriumError(f"seed: found {seed}; accepted: at least 0")
    if position is not None and model == ELASTIC:
        raise EquilibriumError("position: found with elastic cables; accepted: inextensible ones")
    loaded = as_robot(robot, "find_equilibria")

    def report(done: int, total: int) -> None:
        if follow.stop():
            raise StoppedError(f"stopped after {done} of {total} searches; nothing is kept")
        follow.progress(Progress(loaded.name, done, total, unit="searches"))

    motion = loaded.motion_type()
    platform = HangingPlatform(
        cables=loaded.cable_set(pulleys and model == ELASTIC),
        weight_W=loaded.platform.mass * loaded.gravity_vector(), p_PCo=loaded.center_of_mass(),
        num_turns=motion.num_turns, num_moves=motion.num_moves, axis=motion.axis,
        home=loaded.joint().nearest(loaded.home.transform()),
    )  # fmt: skip
    subject: dict[str, Any]
    l0 = None if lengths is None else checked_lengths(lengths, len(loaded.cables), loaded.name)
    if l0 is not None and model == ELASTIC:
        sample = sample_equilibria(
            platform, l0, most=searches, seed=seed, starts=[platform.home], report=report
        )
        evidence: dict[str, Any] = {
            "method": "multi-start", "complete": False, "searches": sample.searches,
            "ended_at_rest": sample.ended,
            "expected_in_all": sample.expected if np.isfinite(sample.expected) else None,
            "covered_share_of_starts": sample.covered, "stopped_by_rule": sample.stopped,
            "seed": seed,
        }  # fmt: skip
        return Equilibria(robot=loaded, model=model, platform=platform, lengths=l0,
                          rests=sample.rests, evidence=evidence)  # fmt: skip
    if l0 is not None:
        every = enumerate_equilibria(platform, l0, report)
        rests, paths, subject = every.rests, every.paths, {"taut_sets": every.sets}
    else:
        p_WP = np.asarray(position, float)
        if p_WP.shape != (3,) or not np.all(np.isfinite(p_WP)):
            raise EquilibriumError(f"position: found {position}; accepted: x, y, z [m]")
        names = [cable.name for cable in loaded.cables]
        chosen = names if taut is None else list(taut)
        for name in chosen:
            if name not in names:
                raise EquilibriumError(f"taut: found {name!r}; {accepted_names(name, names)}")
        held = enumerate_at_position(platform, p_WP, [names.index(name) for name in chosen])
        rests, paths, subject = held.rests, held.paths, {"taut": chosen}
    evidence = {
        "method": "all complex solutions along paths, and closed forms",
        "complete": paths.lost == 0, "systems": paths.systems, "paths": paths.paths,
        "to_infinity": paths.away, "to_singular_solutions": paths.singular, "lost": paths.lost,
        **subject,
    }  # fmt: skip
    return Equilibria(robot=loaded, model=model, platform=platform, lengths=l0, rests=rests,
                      evidence=evidence)  # fmt: skip
