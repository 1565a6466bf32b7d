"""What the theses state of their examples, judged."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CONSTRUCTION,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.worked_examples.examples import (
    DURATION,
    END,
    METHODS,
    OFF,
    POSES,
    POTT,
    PRINTED,
    START,
    TRAJECTORY,
    motion,
)

SAME = 1e-9
"""Motions that differ by less are the same [m, m/s, m/s^2]: rounding over metres and 100 s."""

ROUNDED = 0.005
"""The thesis prints tensions with two decimals [N]."""

POSE_ROUNDED = 0.025
"""Printed tensions at a pose that was measured, and printed by centimetres, may differ by so much
[N]: a millimetre changes them by about 0.01 N."""

EVEN = 0.1
"""Tensions are equal that differ from their mean by no more than this share of it."""

FAR = 2.0
"""Significantly more, or less: by this factor."""

CHEAP, CHEAPER = 10.0, 100.0
"""A very low, and a low cost of a pose [us]: a hundredth and a tenth of the millisecond in which a
controller asks for tensions, Gazebo thesis 6.4."""

MUCH_LESS = 0.5
"""A cost that a source says of one method and not of the other that it names beside it is at most
this share of the other's."""


@statement(
    "Two programs draw the same positions, velocities and accelerations.",
    "figures 6.2, 6.4 and 6.6 beside 6.3, 6.5 and 6.7",
    source="Gazebo thesis 6.2",
    rule=f"differ by less than {SAME:g} m, m/s, m/s^2",
)
def two_programs(runs: Runs) -> Finding:
    """Figures 6.2 to 6.7."""
    row = runs.one(example=TRAJECTORY)
    pairs = zip(motion(row, "class"), motion(row, "conditions"), strict=True)
    off = [float(np.max(np.abs(a - b))) for a, b in pairs]
    return Finding(
        found=f"differ at most by {off[0]:.1g} m, {off[1]:.1g} m/s, {off[2]:.1g} m/s^2",
        held=[one < SAME for one in off],
        some=off[0] < SAME,
        why="Here the class that moves simulated robots, and six equations for (6.9) to (6.14), "
        "solved numerically.",
    )


@statement(
    "The trajectory goes from rest at (0, -2, 2) m to rest at (3, 1, 3) m in 100 s.",
    "section 6.2",
    source="Gazebo thesis 6.2",
    rule=f"less than {SAME:g} m, m/s, m/s^2 off at both ends",
    basis=CONSTRUCTION,
)
def meets_conditions(runs: Runs) -> Finding:
    """Conditions (6.9) to (6.14)."""
    off = _end_errors(runs.one(example=TRAJECTORY), "class")
    return Finding(
        found=f"largest error at both ends {max(off):.1g} m, m/s, m/s^2", held=[max(off) < SAME]
    )


@statement(
    "The coefficients (6.16) to (6.21) meet the conditions at both ends.",
    "equations (6.16) to (6.21)",
    source="Gazebo thesis 6.2",
    rule=f"less than {SAME:g} m, m/s, m/s^2 off",
    cause=SOURCE,
)
def printed_coefficients(runs: Runs) -> Finding:
    """Equations (6.19) to (6.21)."""
    row = runs.one(example=TRAJECTORY)
    ends = ", ".join(f"{x:g}" for x in np.round(motion(row, "printed")[0][-1], 3))
    return Finding(
        found=f"as printed they lead to ({ends}) m after {DURATION:g} s",
        held=[max(_end_errors(row, "printed")) < SAME],
        why="b of (6.20) has the wrong sign: from rest to rest it is -30 (x_f - x_i) / (2 T^4). "
        "The figures must have been drawn with the right one. See docs/theory/corrections.md.",
    )


def _end_errors(row: Run, program: str) -> list[float]:
    still = np.zeros(3)
    wanted = ((START, END), (still, still), (still, still))
    return [
        float(np.max(np.abs(values[[0, -1]] - np.array(ends))))
        for values, ends in zip(motion(row, program), wanted, strict=True)
    ]


def _tensions(pose: str, near: float, words: str, why: str) -> Check:
    @statement(
        words, ", ".join(f"{t:.2f}" for t in PRINTED[pose]) + " N", name=f"{pose}_tensions",
        source="servoing thesis 1.3.4", rule=f"each cable's within {near:g} N",
    )  # fmt: skip
    def check(runs: Runs) -> Finding:
        ours = np.array(runs.one(example=pose)["tensions_n"]["barycenter"])
        off = np.abs(ours - np.array(PRINTED[pose]))
        return Finding(
            found=", ".join(f"{t:.2f}" for t in ours) + f" N; at most {np.max(off):.3f} N off",
            held=(off <= near).tolist(),
            some=float(np.mean(off)) <= near,
            why=why,
        )

    return check


@statement(
    "In the homing pose all cables are equally tensed.",
    "5.13 to 5.46 N",
    source="servoing thesis 1.3.4",
    rule=f"within {100.0 * EVEN:g} % of their mean",
)
def equally_tensed(runs: Runs) -> Finding:
    """Section 1.3.4."""
    t = np.array(runs.one(example="homing")["tensions_n"]["barycenter"])
    spread = float(np.max(np.abs(t / np.mean(t) - 1.0)))
    return Finding(
        found=f"{np.min(t):.2f} to {np.max(t):.2f} N, {100.0 * spread:.1f} % from their mean",
        held=[spread <= EVEN],
    )


@statement(
    "Near the border C7 and C8 are significantly more tensed than the others.",
    "12.76 and 13.31 against at most 4.30 N",
    source="servoing thesis 1.3.4",
    rule=f"significantly: {FAR:g} times",
)
def two_cables_more(runs: Runs) -> Finding:
    """Section 1.3.4."""
    t = np.array(runs.one(example="border")["tensions_n"]["barycenter"])
    ratio = float(np.min(t[6:]) / np.max(t[:6]))
    return Finding(
        found=f"{t[6]:.2f} and {t[7]:.2f} against at most {np.max(t[:6]):.2f} N",
        held=[ratio >= FAR],
        some=ratio > 1.0,
    )


@statement(
    "Near the border the feasible polygon is significantly smaller.",
    "figure 1.19",
    source="servoing thesis 1.3.4",
    rule=f"significantly: {FAR:g} times",
)
def polygon_shrinks(runs: Runs) -> Finding:
    """Section 1.3.4."""
    areas = {name: runs.one(example=name)["area_n2"] for name in ("homing", "border")}
    return Finding(
        found=f"{areas['homing']:.1f} N^2 in the homing pose, {areas['border']:.1f} N^2 near the "
        "border",
        held=[areas["homing"] >= FAR * areas["border"]],
        some=areas["homing"] > areas["border"],
        why="Area in the plane of the orthonormal null space.",
    )


@statement(
    "The barycenter is the solution that is as far as possible from all of the limits.",
    "section 1.3.4",
    source="servoing thesis 1.3.4",
    rule=f"by no more than {ROUNDED:g} N nearer than possible, at both poses",
    cause=SOURCE,
)
def farthest_from_limits(runs: Runs) -> Finding:
    """What section 1.3.4 says the barycenter is."""
    margins = {name: runs.one(example=name)["margins_n"] for name in POSES}
    return Finding(
        found="; ".join(
            f"{name}: {of['barycenter']:.2f} N from the nearest limit, "
            f"{of['optimally_safe']:.2f} N is possible"
            for name, of in margins.items()
        ),
        held=[of["barycenter"] >= of["optimally_safe"] - ROUNDED for of in margins.values()],
        why="The barycenter is the mean of the polygon. What is farthest from all limits is the "
        "centre of its largest inscribed ball in the tensions, by the method optimally_safe; the "
        "two meet only in symmetric polygons.",
    )


@statement(
    "Where the barycenter method finds a solution, it respects all limits.",
    "section 1.3.4",
    source="servoing thesis 1.3.4",
    rule=f"limits and balance within {OFF:g} N, N m",
)
def keeps_limits(runs: Runs) -> Finding:
    """What section 1.3.4 says of [Gou+15]."""
    row = runs.one(example=METHODS)
    wrong, solved = row["wrong"]["barycenter"], row["solved"]["barycenter"]
    return Finding(
        found=f"{wrong} of its {solved} solutions break a limit or the balance; {row['poses']} "
        "poses can be held, by a linear program",
        held=[wrong == 0 < solved],
    )


@statement(
    "Without a tension distribution, -W^+ w can have negative tensions, though others hold.",
    "section 1.3.4",
    source="servoing thesis 1.3.4",
    rule="at one pose at least",
)
def pushes(runs: Runs) -> Finding:
    """What section 1.3.4 says of the pseudo-inverse."""
    row = runs.one(example=METHODS)
    pushing = row["pushing"]["pseudo_inverse"]
    return Finding(
        found=f"at {pushing} of {row['poses']} poses of a grid that can be held",
        held=[pushing > 0],
    )


@statement(
    "The median method [Pot14] has a very low computation cost.",
    "in words",
    source="servoing thesis 1.3.4",
    rule=f"very low: at most {CHEAP:g} us a pose, a hundredth of a control period of 1 ms, and at "
    f"most {MUCH_LESS:g} of the cost of the barycenter method, the other one that the sentence "
    f"names; in part: at most {CHEAPER:g} us",
    cause=SOURCE,
)
def median_cheap(runs: Runs) -> Finding:
    """What section 1.3.4 says of costs."""
    row = runs.one(example=METHODS)
    costs, missed = row["cost_us"], row["poses"] - row["solved"][POTT]
    return Finding(
        found=f"{costs[POTT]:.2f} us a pose, barycenter method {costs['barycenter']:.2f} us; "
        f"with the search where it misses {costs['median']:.2f} us",
        held=[costs[POTT] <= CHEAP, costs[POTT] <= MUCH_LESS * costs["barycenter"]],
        some=costs[POTT] <= CHEAPER,
        why="The sentence says no cost, and says it of one of two methods, which it has to tell "
        "apart: most of either goes into factoring W. Processor time of compiled code on one "
        "core, the same poses in turns. [Pot14] "
        f"is the improved closed form, which misses {missed} of {row['poses']} poses that can be "
        "held.",
    )


CHECKS = (
    two_programs, meets_conditions, printed_coefficients,
    _tensions(
        "homing", POSE_ROUNDED, "Barycenter method in the homing pose (figure 1.19a).",
        "The homing pose is the real platform's, measured.",
    ),
    _tensions(
        "border", ROUNDED, "Barycenter method near the border (figure 1.19b).",
        "The bound is the rounding of what is printed.",
    ),
    equally_tensed, two_cables_more, polygon_shrinks, farthest_from_limits, keeps_limits,
    pushes, median_cheap,
)  # fmt: skip
