"""What the theses state about workspaces, and what has to hold between kinds, judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from types import MappingProxyType

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, verdict
from cdpr_drake.analyses.studies.workspaces.distances import SAME
from cdpr_drake.analyses.studies.workspaces.items import (
    ALONE,
    ENDLESS,
    EVERY,
    FIGURE,
    HEAVY,
    OTHER_MASS,
    STRONG,
    UPPER_SHARES,
    ZERO,
    FoundWorkspace,
)

KEPT = 0.9
"""A workspace that keeps this share of its volume remains large, and is not reduced too much."""

CLOSE = 0.01
"""Nearer to `KEPT` than this the verdict hangs on the grid: in part."""

SAME_SHARE = 0.02
"""Shares of the frame that differ by less do not depend on what was changed."""

INNER = {
    "wrench-feasible": ("static",),
    "dynamic": ("static",),
    "statically-stable": ("static", "singularity-free"),
}
"""Kinds that lie within others, by what they are: their sets contain zero, or they ask for more."""


class FoundSet:
    """Answers of the study, by what they are for."""

    def __init__(
        self,
        found: Sequence[FoundWorkspace],
        distances: Mapping[str, Mapping[str, np.ndarray]] = MappingProxyType({}),
    ) -> None:
        """Takes the questions that were finished, and comparisons of distances by robot."""
        self._found = tuple(found)
        self.distances = dict(distances)

    def of(self, group: str) -> list[FoundWorkspace]:
        """All of a group.

        Raises:
            KeyError: There are none.
        """
        some = [one for one in self._found if one.item.group == group]
        if not some:
            raise KeyError(group)
        return some

    def pairs(self, group: str) -> list[tuple[FoundWorkspace, FoundWorkspace]]:
        """Every kind of a robot, and a question of a group on the same poses.

        Raises:
            KeyError: There are none.
        """
        every = {one.item.robot: one for one in self.of(EVERY)}
        some = [one for one in self.of(group) if one.item.robot in every]
        if not some:
            raise KeyError(group)
        return [(every[one.item.robot], one) for one in some]

    def figure(self, robot: str, upper_share: float = 1.0) -> list[FoundWorkspace]:
        """Static workspaces of a robot at one upper limit, by rising lower limit.

        Raises:
            KeyError: There are not two of them.
        """
        some = [
            one for one in self._found
            if one.item.group == FIGURE and one.item.robot == robot
            and one.item.upper_share == upper_share
        ]  # fmt: skip
        if len(some) < 2:
            raise KeyError(robot)
        return sorted(some, key=lambda one: one.item.limits[0])


def workspace_statements(
    found: Sequence[FoundWorkspace],
    distances: Mapping[str, Mapping[str, np.ndarray]] = MappingProxyType({}),
    quick: bool = False,
) -> list[Statement]:
    """Statements for which enough was finished.

    Args:
        found: Questions that were finished.
        distances: What `DistanceTask` found, by robot.
        quick: Whether they are all that is coming, of the quick form.
    """
    return evaluate_checks(CHECKS, FoundSet(found, distances), quick)


def _count(mask: np.ndarray) -> int:
    return int(np.count_nonzero(mask))


def _static(one: FoundWorkspace) -> np.ndarray:
    return one.holds["static"]


def _kept(low: FoundWorkspace, high: FoundWorkspace) -> float:
    """Volume with the higher lower limit over that with the lower one; 0 if both are empty."""
    whole = low.volume(_static(low)).value
    return high.volume(_static(high)).value / whole if whole > 0.0 else 0.0


def _shares(some: Sequence[FoundWorkspace]) -> str:
    return ", ".join(
        f"{100.0 * one.volume(_static(one)).share:.1f} % at {one.item.limits[0]:g} N"
        for one in some
    )


def _acrobot(found: FoundSet) -> Statement:
    small, large = (found.figure(name) for name in ("acrobot_small", "acrobot_large"))
    kept = _kept(*large)
    return Statement(
        "ACROBOT, large platform: with the lower limit 1 N the static workspace remains large "
        "(figure 1.17, 5.3.1).",
        f"no numbers; large here: {100.0 * KEPT:g} % of the volume at 0 N",
        f"{_shares(large)} of the frame; keeps {100.0 * kept:.1f} %",
        verdict(kept >= KEPT + CLOSE, kept >= KEPT - CLOSE),
        f"The upper limit is not printed: {large[0].item.limits[1]:g} N, the robot file's. The "
        f"small platform, of which this is not said: {_shares(small)}, keeps "
        f"{100.0 * _kept(*small):.1f} %.",
    )


def _caroca(found: FoundSet) -> Statement:
    both = found.figure("caroca")
    kept = _kept(*both)
    return Statement(
        "CAROCA: the lower limit 30 N does not reduce the static workspace too much (figure 1.18).",
        f"no numbers; not too much here: {100.0 * KEPT:g} % of the volume at 0 N are kept",
        f"{_shares(both)} of the frame; keeps {100.0 * kept:.1f} %",
        verdict(kept >= KEPT + CLOSE, kept >= KEPT - CLOSE),
        f"The upper limit is not printed: {both[0].item.limits[1]:g} N, the robot file's.",
    )


def _platforms(found: FoundSet) -> Statement:
    small, large = (found.figure(name) for name in ("acrobot_small", "acrobot_large"))
    parts = [
        _count(_static(a) ^ _static(b)) / len(_static(a)) for a, b in zip(small, large, strict=True)
    ]
    return Statement(
        "The shape of the static workspace depends on the platform (1.3.3).",
        f"no numbers; here: {100.0 * SAME_SHARE:g} % of the poses at least",
        f"ACROBOT's platforms differ on {100.0 * parts[0]:.1f} % of the frame's poses at 0 N, on "
        f"{100.0 * parts[1]:.1f} % at 1 N",
        verdict(min(parts) >= SAME_SHARE, max(parts) >= SAME_SHARE),
        "Confirmed where the platforms differ at both lower limits, in part where at one.",
    )


def _upper_limit(found: FoundSet) -> Statement:
    robots = list(dict.fromkeys(one.item.robot for one in found.of(FIGURE)))
    moved = {}
    for robot in robots:
        by_upper = [found.figure(robot, share) for share in UPPER_SHARES]
        moved[robot] = max(
            abs(one.volume(_static(one)).share - own.volume(_static(own)).share)
            for other in by_upper
            for one, own in zip(other, by_upper[0], strict=True)
        )
    good = [value < SAME_SHARE for value in moved.values()]
    return Statement(
        "Figures 1.17 and 1.18 do not hang on the upper limit, which is not printed.",
        f"none; here: half and twice the robot file's change less than {100.0 * SAME_SHARE:g} % "
        "of the frame",
        ", ".join(f"{robot} {100.0 * value:.1f} %" for robot, value in moved.items()),
        verdict(all(good), any(good)),
        "Confirmed where it is so for all robots, in part where for some.",
    )


def _lower_limit(found: FoundSet) -> Statement:
    robots = list(dict.fromkeys(one.item.robot for one in found.of(FIGURE)))
    outside, poses = 0, 0
    for robot in robots:
        for share in UPPER_SHARES:
            low, high = found.figure(robot, share)
            outside += _count(_static(high) & ~_static(low))
            poses += _count(_static(high))
    return Statement(
        "Static workspaces at a lower limit of 0 N contain those at 1 N and 30 N.",
        "0 poses outside",
        f"{outside} of {poses} poses outside",
        verdict(outside == 0 < poses),
    )


def _weight(found: FoundSet) -> Statement:
    pairs = found.pairs(HEAVY)
    kind = "wrench-closure"
    wrong = sum(_count(every.holds[kind] ^ heavy.holds[kind]) for every, heavy in pairs)
    closed = sum(_count(every.holds[kind]) for every, _ in pairs)
    return Statement(
        "Wrench closure does not depend on the weight.",
        f"0 poses change with {OTHER_MASS:g} times the mass",
        f"{wrong} poses change; {closed} have closure, {len(pairs)} robots",
        verdict(wrong == 0 < closed, wrong == 0),
    )


def _closure(found: FoundSet) -> Statement:
    pairs = [(e, s) for e, s in found.pairs(ENDLESS) if "wrench-closure" in e.holds]
    if not pairs:
        raise KeyError(ENDLESS)
    wrong = sum(_count(every.holds["wrench-closure"] & ~_static(strong)) for every, strong in pairs)
    closed = sum(_count(every.holds["wrench-closure"]) for every, _ in pairs)
    return Statement(
        "Where there is wrench closure, cables without upper limit hold the weight.",
        f"0 poses fail, upper limit {STRONG:g} N",
        f"{wrong} of {closed} poses fail",
        verdict(wrong == 0 < closed, wrong == 0),
    )


def _zero(found: FoundSet, kind: str, words: str) -> Statement:
    pairs = found.pairs(ZERO)
    wrong = sum(_count(zero.holds[kind] ^ _static(every)) for every, zero in pairs)
    held = sum(_count(_static(every)) for every, _ in pairs)
    poses = sum(len(_static(every)) for every, _ in pairs)
    return Statement(
        words,
        "0 poses differ",
        f"{wrong} of {poses} poses differ; {held} are static, {len(pairs)} robots",
        verdict(wrong == 0 < held),
        "Facets of the available wrenches against a search for tensions: different computations.",
    )


def _dynamic(found: FoundSet) -> Statement:
    words = "Dynamic without acceleration and velocity is static."
    return _zero(found, "dynamic", words)


def _wrench(found: FoundSet) -> Statement:
    words = "Wrench-feasible with no wrench but zero is static."
    return _zero(found, "wrench-feasible", words)


def _within(found: FoundSet) -> Statement:
    parts, wrong = [], 0
    for inner, outers in INNER.items():
        for outer in outers:
            both = [e for e in found.of(EVERY) if inner in e.holds and outer in e.holds]
            outside = sum(_count(one.holds[inner] & ~one.holds[outer]) for one in both)
            wrong += outside
            inside = sum(_count(one.holds[inner]) for one in both)
            parts.append(f"{inner} in {outer}: {outside} of {inside}")
    return Statement(
        "Wrench-feasible and dynamic lie within static, statically stable within static and "
        "singularity-free.",
        "0 poses outside",
        "; ".join(parts),
        verdict(wrong == 0),
    )


def _intersections(found: FoundSet) -> Statement:
    by_robot: dict[str, dict[str, np.ndarray]] = {}
    together = {}
    for every, alone in found.pairs(ALONE):
        by_robot.setdefault(every.item.robot, {}).update(alone.holds)
        together[every.item.robot] = every
    outside = common = changed = 0
    for robot, single in by_robot.items():
        holds = together[robot].holds
        changed += sum(_count(holds[kind] ^ single[kind]) for kind in single)
        for a, b in combinations(single, 2):
            both = holds[a] & holds[b]
            common += _count(both)
            outside += _count(both & ~(single[a] & single[b]))
    return Statement(
        "What two kinds, asked for together, have in common lies in each of them, asked for by "
        "itself.",
        "0 poses outside, 0 differ between together and alone",
        f"{outside} of {common} outside, {changed} differ; {len(by_robot)} robots",
        verdict(outside == 0 < common and changed == 0),
    )


def _drake(found: FoundSet) -> Statement:
    if not found.distances:
        raise KeyError("distances")
    wrong = sum(_count(one["wrong"]) for one in found.distances.values())
    poses = sum(len(one["wrong"]) for one in found.distances.values())
    settled = sum(_count(one["settled"]) for one in found.distances.values())
    most = max(float(np.max(one["differences"])) for one in found.distances.values())
    return Statement(
        "Clearances of cables from each other, the platform and the frame are those of Drake's "
        "geometry queries.",
        f"0 poses differ by more than {SAME:g} m",
        f"{wrong} of {poses} poses differ, at most by {most:.2g} m; at {settled} of them Drake "
        f"differs, and bounded least squares decides; {', '.join(found.distances)}",
        verdict(wrong == 0 < poses),
        "Drake stops its iterations for capsules at points that are not always the nearest.",
    )


CHECKS = (
    _acrobot, _caroca, _platforms, _upper_limit, _lower_limit, _weight, _closure, _dynamic, _wrench,
    _within, _intersections, _drake,
)  # fmt: skip
