"""What the theses state of their examples, judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, verdict
from cdpr_drake.analyses.studies.worked_examples.motion import DURATION, END, START, SampledMotion
from cdpr_drake.analyses.studies.worked_examples.tensions import (
    POTT,
    PRINTED,
    ExamplePolygon,
    MethodOnGrid,
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

CHEAP, CHEAPER = 0.5, 0.9
"""A very low, and a lower cost: at most these shares of the other's."""


@dataclass(frozen=True, eq=False)
class FoundExamples:
    """What the study found.

    Attributes:
        motions: By program: "class", "conditions", "printed".
        polygons: By pose of figure 1.19.
        methods: By method, on the grid.
    """

    motions: Mapping[str, SampledMotion]
    polygons: Mapping[str, ExamplePolygon]
    methods: Mapping[str, MethodOnGrid]


def example_statements(found: FoundExamples, quick: bool) -> list[Statement]:
    """The statements for which enough was finished."""
    return evaluate_checks(CHECKS, found, quick)


def two_programs(found: FoundExamples) -> Statement:
    """Figures 6.2 to 6.7."""
    pairs = zip(found.motions["class"].parts(), found.motions["conditions"].parts(), strict=True)
    off = [float(np.max(np.abs(a - b))) for a, b in pairs]
    return Statement(
        "Two programs draw the same positions, velocities and accelerations.",
        "figures 6.2, 6.4 and 6.6 beside 6.3, 6.5 and 6.7",
        f"differ at most by {off[0]:.1g} m, {off[1]:.1g} m/s, {off[2]:.1g} m/s^2",
        verdict(max(off) < SAME, off[0] < SAME),
        "Here the class that moves simulated robots, and six equations for (6.9) to (6.14), solved "
        "numerically.",
    )


def meets_conditions(found: FoundExamples) -> Statement:
    """Conditions (6.9) to (6.14)."""
    off = _end_errors(found.motions["class"])
    return Statement(
        "The trajectory goes from rest at (0, -2, 2) m to rest at (3, 1, 3) m in 100 s.",
        "section 6.2",
        f"largest error at both ends {max(off):.1g} m, m/s, m/s^2",
        verdict(max(off) < SAME),
    )


def printed_coefficients(found: FoundExamples) -> Statement:
    """Equations (6.19) to (6.21)."""
    motion = found.motions["printed"]
    off = _end_errors(motion)
    ends = ", ".join(f"{x:g}" for x in np.round(motion.positions[-1], 3))
    return Statement(
        "The coefficients (6.16) to (6.21) meet the conditions at both ends.",
        "equations (6.16) to (6.21)",
        f"as printed they lead to ({ends}) m after {DURATION:g} s",
        verdict(max(off) < SAME),
        "b of (6.20) has the wrong sign: from rest to rest it is -30 (x_f - x_i) / (2 T^4). The "
        "figures must have been drawn with the right one. See docs/theory/corrections.md.",
    )


def _end_errors(motion: SampledMotion) -> list[float]:
    still = np.zeros(3)
    wanted = ((START, END), (still, still), (still, still))
    return [
        float(np.max(np.abs(values[[0, -1]] - np.array(ends))))
        for values, ends in zip(motion.parts(), wanted, strict=True)
    ]


def _tensions(found: FoundExamples, name: str, near: float, words: str, why: str) -> Statement:
    ours = found.polygons[name].tensions["barycenter"]
    off = np.abs(ours - np.array(PRINTED[name]))
    return Statement(
        words,
        ", ".join(f"{t:.2f}" for t in PRINTED[name]) + " N",
        ", ".join(f"{t:.2f}" for t in ours) + f" N; at most {np.max(off):.3f} N off",
        verdict(float(np.max(off)) <= near, float(np.mean(off)) <= near),
        why,
    )


def homing_tensions(found: FoundExamples) -> Statement:
    """Figure 1.19a."""
    return _tensions(
        found, "homing", POSE_ROUNDED, "Barycenter method in the homing pose (figure 1.19a).",
        f"Confirmed within {POSE_ROUNDED:g} N: the homing pose is the real platform's, measured.",
    )  # fmt: skip


def border_tensions(found: FoundExamples) -> Statement:
    """Figure 1.19b."""
    return _tensions(
        found, "border", ROUNDED, "Barycenter method near the border (figure 1.19b).",
        f"Confirmed within {ROUNDED:g} N, the rounding of what is printed.",
    )  # fmt: skip


def equally_tensed(found: FoundExamples) -> Statement:
    """Section 1.3.4."""
    t = found.polygons["homing"].tensions["barycenter"]
    spread = float(np.max(np.abs(t / np.mean(t) - 1.0)))
    return Statement(
        "In the homing pose all cables are equally tensed.",
        "5.13 to 5.46 N",
        f"{np.min(t):.2f} to {np.max(t):.2f} N, {100.0 * spread:.1f} % from their mean",
        verdict(spread <= EVEN),
        f"Equal: within {100.0 * EVEN:g} % of their mean.",
    )


def two_cables_more(found: FoundExamples) -> Statement:
    """Section 1.3.4."""
    t = found.polygons["border"].tensions["barycenter"]
    ratio = float(np.min(t[6:]) / np.max(t[:6]))
    return Statement(
        "Near the border C7 and C8 are significantly more tensed than the others.",
        "12.76 and 13.31 against at most 4.30 N",
        f"{t[6]:.2f} and {t[7]:.2f} against at most {np.max(t[:6]):.2f} N",
        verdict(ratio >= FAR, ratio > 1.0),
        f"Significantly: {FAR:g} times.",
    )


def polygon_shrinks(found: FoundExamples) -> Statement:
    """Section 1.3.4."""
    areas = {name: found.polygons[name].area for name in ("homing", "border")}
    return Statement(
        "Near the border the feasible polygon is significantly smaller.",
        "figure 1.19",
        f"{areas['homing']:.1f} N^2 in the homing pose, {areas['border']:.1f} N^2 near the border",
        verdict(areas["homing"] >= FAR * areas["border"], areas["homing"] > areas["border"]),
        f"Significantly: {FAR:g} times. Area in the plane of the orthonormal null space.",
    )


def farthest_from_limits(found: FoundExamples) -> Statement:
    """What section 1.3.4 says the barycenter is."""
    pairs = {
        name: tuple(found.polygons[name].margin(m) for m in ("barycenter", "optimally_safe"))
        for name in PRINTED
    }
    good = [ours >= best - ROUNDED for ours, best in pairs.values()]
    return Statement(
        "The barycenter is the solution that is as far as possible from all of the limits.",
        "section 1.3.4",
        "; ".join(
            f"{name}: {ours:.2f} N from the nearest limit, {best:.2f} N is possible"
            for name, (ours, best) in pairs.items()
        ),
        verdict(all(good), any(good)),
        "The barycenter is the mean of the polygon. What is farthest from all limits is the centre "
        "of its largest inscribed ball in the tensions, by the method optimally_safe; the two "
        "meet only in symmetric polygons.",
    )


def keeps_limits(found: FoundExamples) -> Statement:
    """What section 1.3.4 says of [Gou+15]."""
    one = found.methods["barycenter"]
    return Statement(
        "Where the barycenter method finds a solution, it respects all limits.",
        "section 1.3.4",
        f"{one.wrong} of its {one.solved} solutions break a limit or the balance; {one.poses} "
        "poses can be held, by a linear program",
        verdict(one.wrong == 0 < one.solved),
    )


def pushes(found: FoundExamples) -> Statement:
    """What section 1.3.4 says of the pseudo-inverse."""
    one = found.methods["pseudo_inverse"]
    return Statement(
        "Without a tension distribution, -W^+ w can have negative tensions, though others hold.",
        "section 1.3.4",
        f"at {one.pushing} of {one.poses} poses of a grid that can be held",
        verdict(one.pushing > 0),
    )


def median_cheap(found: FoundExamples) -> Statement:
    """What section 1.3.4 says of costs."""
    costs = {name: found.methods[name].microseconds for name in (POTT, "median", "barycenter")}
    pott = costs[POTT] / costs["barycenter"]
    missed = found.methods[POTT].poses - found.methods[POTT].solved
    return Statement(
        "The median method [Pot14] has a very low computation cost, beside the barycenter method.",
        "section 1.3.4",
        f"{costs[POTT]:.2f} us a pose, barycenter {costs['barycenter']:.2f} us; "
        f"with the search where it misses {costs['median']:.2f} us",
        verdict(pott <= CHEAP, pott <= CHEAPER),
        f"Very low: at most {100.0 * CHEAP:g} % of the other's; in part: at most "
        f"{100.0 * CHEAPER:g} %. Compiled, each takes one or two microseconds, most of it for "
        "factoring W, which all of them do. Processor time of compiled code on "
        f"one core, the same poses in turns. [Pot14] is the improved closed form, which misses "
        f"{missed} of {found.methods[POTT].poses} poses that can be held.",
    )


CHECKS = (
    two_programs, meets_conditions, printed_coefficients, homing_tensions, border_tensions,
    equally_tensed, two_cables_more, polygon_shrinks, farthest_from_limits, keeps_limits, pushes,
    median_cheap,
)  # fmt: skip
