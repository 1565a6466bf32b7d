"""What the theses state about workspaces, and what has to hold between kinds, judged."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    FITTED,
    OURS,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.workspaces.distances import SAME
from cdpr_drake.analyses.studies.workspaces.items import (
    ALONE,
    DISTANCES,
    ENDLESS,
    EVERY,
    FIGURE,
    HEAVY,
    OTHER_MASS,
    STRONG,
    UPPER_SHARES,
    ZERO,
    holds_of,
    static,
)

KEPT = 0.9
"""A workspace that keeps this share of its volume remains large, and is not reduced too much."""

RULE = (
    f"keeps at least {100.0 * KEPT:g} %, whatever the grid; in part: the grid decides, since every "
    "second of its points along each axis would change what is kept by more than its distance "
    f"from {100.0 * KEPT:g} %"
)
"""When a workspace remains large."""

SAME_SHARE = 0.02
"""Shares of the frame that differ by less do not depend on what was changed."""

INNER = {
    "wrench-feasible": ("static",),
    "dynamic": ("static",),
    "statically-stable": ("static", "singularity-free"),
}
"""Kinds that lie within others, by what they are: their sets contain zero, or they ask for more."""


def pairs(runs: Runs, group: str) -> list[tuple[Run, Run]]:
    """Every kind of a robot, and a question of a group on the same poses.

    Raises:
        MissingRuns: There are none.
    """
    every = {run["robot"]: run for run in runs(group=EVERY)}
    some = [(every[run["robot"]], run) for run in runs(group=group) if run["robot"] in every]
    if not some:
        raise MissingRuns(group)
    return some


def at_limits(runs: Runs, robot: str, upper_share: float = 1.0) -> list[Run]:
    """Static workspaces of a robot at one upper limit, by rising lower limit.

    Raises:
        MissingRuns: There are not two of them.
    """
    some = runs(group=FIGURE, robot=robot, upper_share=upper_share)
    if len(some) < 2:
        raise MissingRuns(robot)
    return sorted(some, key=lambda run: float(run["lower_limit_n"]))


def _count(mask: np.ndarray) -> int:
    return int(np.count_nonzero(mask))


def kept(low: Run, high: Run) -> tuple[float, float]:
    """Volume with the higher lower limit over that with the lower one, 0 if both are empty, and by
    how much half as many cells along each axis change that."""
    fine, coarse = (
        float(high[column] / low[column]) if low[column] > 0.0 else 0.0
        for column in ("points_m3", "half_points_m3")
    )
    return fine, abs(fine - coarse)


def _remains_large(share: float, error: float, found: str, why: str) -> Finding:
    return Finding(
        found=f"{found} of the frame; keeps {100.0 * share:.1f} %, within {100.0 * error:.1f} %",
        held=[share - error >= KEPT],
        some=share + error >= KEPT,
        why=f"What counts as large is not printed. {why}",
    )


def _shares(some: Sequence[Run]) -> str:
    return ", ".join(
        f"{100.0 * run['frame_share']:.1f} % at {run['lower_limit_n']:g} N" for run in some
    )


@statement(
    "ACROBOT, large platform: with the lower limit 1 N the static workspace remains large "
    "(figure 1.17, 5.3.1).",
    f"no numbers; large here: {100.0 * KEPT:g} % of the volume at 0 N",
    rule=RULE,
    cause=SOURCE,
)
def _acrobot(runs: Runs) -> Finding:
    small, large = (at_limits(runs, name) for name in ("acrobot_small", "acrobot_large"))
    return _remains_large(
        *kept(*large),
        _shares(large),
        f"Nor is the upper limit: {large[0]['upper_limit_n']:g} N, the robot file's. The small "
        f"platform, of which this is not said: {_shares(small)}, keeps "
        f"{100.0 * kept(*small)[0]:.1f} %.",
    )


@statement(
    "CAROCA: the lower limit 30 N does not reduce the static workspace too much (figure 1.18).",
    f"no numbers; not too much here: {100.0 * KEPT:g} % of the volume at 0 N are kept",
    rule=f"{RULE}; the rule for the grid was changed when 90.7 % was known",
    basis=FITTED,
    cause=SOURCE,
)
def _caroca(runs: Runs) -> Finding:
    both = at_limits(runs, "caroca")
    return _remains_large(
        *kept(*both),
        _shares(both),
        f"Nor is the upper limit: {both[0]['upper_limit_n']:g} N, the robot file's.",
    )


@statement(
    "The shape of the static workspace depends on the platform (1.3.3).",
    f"no numbers; here: {100.0 * SAME_SHARE:g} % of the poses at least",
    rule="at both lower limits",
    cause=SOURCE,
    why="By how much shapes differ is not printed. At 0 N both platforms hang wherever "
    "their weight is between the cables, which depends on the frame and little on the "
    "anchor points.",
)
def _platforms(runs: Runs) -> Finding:
    small, large = (at_limits(runs, name) for name in ("acrobot_small", "acrobot_large"))
    parts = [
        _count(static(a) ^ static(b)) / static(a).size for a, b in zip(small, large, strict=True)
    ]
    return Finding(
        found=f"ACROBOT's platforms differ on {100.0 * parts[0]:.1f} % of the frame's poses at 0 "
        f"N, on {100.0 * parts[1]:.1f} % at 1 N",
        held=[part >= SAME_SHARE for part in parts],
    )


@statement(
    "Figures 1.17 and 1.18 do not hang on the upper limit, which is not printed.",
    f"none; here: half and twice the robot file's change less than {100.0 * SAME_SHARE:g} % "
    "of the frame",
    rule="for all robots",
    basis=OURS,
)
def _upper_limit(runs: Runs) -> Finding:
    robots = list(runs(group=FIGURE).counts("robot"))
    moved = {}
    for robot in robots:
        by_upper = [at_limits(runs, robot, share) for share in UPPER_SHARES]
        moved[robot] = max(
            abs(one["frame_share"] - own["frame_share"])
            for other in by_upper
            for one, own in zip(other, by_upper[0], strict=True)
        )
    good = [value < SAME_SHARE for value in moved.values()]
    return Finding(
        found=", ".join(f"{robot} {100.0 * value:.1f} %" for robot, value in moved.items()),
        held=good,
    )


@statement(
    "Static workspaces at a lower limit of 0 N contain those at 1 N and 30 N.",
    "0 poses outside",
    basis=OURS,
)
def _lower_limit(runs: Runs) -> Finding:
    robots = list(runs(group=FIGURE).counts("robot"))
    outside, poses = 0, 0
    for robot in robots:
        for share in UPPER_SHARES:
            low, high = at_limits(runs, robot, share)
            outside += _count(static(high) & ~static(low))
            poses += _count(static(high))
    return Finding(
        found=f"{outside} of {poses} poses outside",
        held=[outside == 0 < poses],
    )


@statement(
    "Wrench closure does not depend on the weight.",
    f"0 poses change with {OTHER_MASS:g} times the mass",
    basis=OURS,
)
def _weight(runs: Runs) -> Finding:
    both = pairs(runs, HEAVY)
    kind = "wrench-closure"
    wrong = sum(_count(every[f"holds_{kind}"] ^ heavy[f"holds_{kind}"]) for every, heavy in both)
    closed = sum(_count(every[f"holds_{kind}"]) for every, _ in both)
    return Finding(
        found=f"{wrong} poses change; {closed} have closure, {len(both)} robots",
        held=[wrong == 0 < closed],
        some=wrong == 0,
    )


@statement(
    "Where there is wrench closure, cables without upper limit hold the weight.",
    f"0 poses fail, upper limit {STRONG:g} N",
    basis=OURS,
)
def _closure(runs: Runs) -> Finding:
    both = [(e, s) for e, s in pairs(runs, ENDLESS) if "wrench-closure" in e["kinds"]]
    if not both:
        raise MissingRuns(ENDLESS)
    wrong = sum(_count(every["holds_wrench-closure"] & ~static(strong)) for every, strong in both)
    closed = sum(_count(every["holds_wrench-closure"]) for every, _ in both)
    return Finding(
        found=f"{wrong} of {closed} poses fail",
        held=[wrong == 0 < closed],
        some=wrong == 0,
    )


def _zero(name: str, kind: str, says: str) -> Check:
    @statement(says, "0 poses differ", name=name, basis=OURS)
    def check(runs: Runs) -> Finding:
        both = pairs(runs, ZERO)
        wrong = sum(_count(zero[f"holds_{kind}"] ^ static(every)) for every, zero in both)
        held = sum(_count(static(every)) for every, _ in both)
        poses = sum(static(every).size for every, _ in both)
        return Finding(
            found=f"{wrong} of {poses} poses differ; {held} are static, {len(both)} robots",
            held=[wrong == 0 < held],
            why="Facets of the available wrenches against a search for tensions: different "
            "computations.",
        )

    return check


@statement(
    "Wrench-feasible and dynamic lie within static, statically stable within static and "
    "singularity-free.",
    "0 poses outside",
    basis=OURS,
)
def _within(runs: Runs) -> Finding:
    parts, wrong = [], 0
    for inner, outers in INNER.items():
        for outer in outers:
            both = [
                (one[inner], one[outer])
                for one in map(holds_of, runs(group=EVERY))
                if inner in one and outer in one
            ]
            outside = sum(_count(a & ~b) for a, b in both)
            wrong += outside
            inside = sum(_count(a) for a, _ in both)
            parts.append(f"{inner} in {outer}: {outside} of {inside}")
    return Finding(
        found="; ".join(parts),
        held=[wrong == 0],
    )


@statement(
    "What two kinds, asked for together, have in common lies in each of them, asked for by itself.",
    "0 poses outside, 0 differ between together and alone",
    basis=OURS,
)
def _intersections(runs: Runs) -> Finding:
    by_robot: dict[str, dict[str, np.ndarray]] = {}
    together = {}
    for every, alone in pairs(runs, ALONE):
        by_robot.setdefault(every["robot"], {}).update(holds_of(alone))
        together[every["robot"]] = holds_of(every)
    outside = common = changed = 0
    for robot, single in by_robot.items():
        holds = together[robot]
        changed += sum(_count(holds[kind] ^ single[kind]) for kind in single)
        for a, b in combinations(single, 2):
            both = holds[a] & holds[b]
            common += _count(both)
            outside += _count(both & ~(single[a] & single[b]))
    return Finding(
        found=f"{outside} of {common} outside, {changed} differ; {len(by_robot)} robots",
        held=[outside == 0 < common and changed == 0],
    )


@statement(
    "Clearances of cables from each other, the platform and the frame are those of Drake's "
    "geometry queries.",
    f"0 poses differ by more than {SAME:g} m",
    basis=OURS,
)
def _drake(runs: Runs) -> Finding:
    some = runs(group=DISTANCES)
    wrong, poses, settled = (some.total(column) for column in ("differ", "poses", "settled"))
    most = some.largest("difference_m")
    return Finding(
        found=f"{wrong} of {poses} poses differ, at most by {most:.2g} m; at {settled} of them "
        f"Drake differs, and bounded least squares decides; {', '.join(some.list('robot'))}",
        held=[wrong == 0 < poses],
        why="Drake stops its iterations for capsules at points that are not always the nearest.",
    )


CHECKS = (
    _acrobot, _caroca, _platforms, _upper_limit, _lower_limit, _weight, _closure,
    _zero("dynamic", "dynamic", "Dynamic without acceleration and velocity is static."),
    _zero("wrench", "wrench-feasible", "Wrench-feasible with no wrench but zero is static."),
    _within, _intersections, _drake,
)  # fmt: skip
