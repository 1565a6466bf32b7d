"""What the servoing thesis states about the planar robot, beside what was found."""

from __future__ import annotations

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.stability_ranges.answers import (
    NESTED,
    FoundRows,
    falls,
    found,
    pairs,
)
from cdpr_drake.analyses.studies.stability_ranges.item import PLANAR_ROBOT, PLANAR_VISION
from cdpr_drake.analyses.studies.stability_ranges.vision import PLANAR_NUMBERS

SIGNIFICANT = 1.1
"""An increase by this factor counts as significant."""

ROTATION = 46.0
"""Rotation of the platform that the thesis found possible [deg]."""


def vision_alone(rows: FoundRows) -> Statement:
    """Analysis I."""
    limit = rows.named("planar-I").found
    return Statement(
        "Planar, vision alone: stable while the object's place is off by less than 2 m.",
        "2 m, (3.12)",
        f"{limit:.3f} m",
        verdict(abs(limit - 2.0) < 2e-3),
        "Nearly by construction: where the robot is exact, the criterion is the printed condition. "
        "This tests how it is computed, not the robot.",
    )


def combinations(rows: FoundRows) -> Statement:
    """Combinations 2 and 13 of analysis II."""
    known = [row for row in rows.of(PLANAR_VISION, "II") if row.published is not None]
    words = []
    for row in known:
        name = PLANAR_NUMBERS[row.limits["error"], row.limits["r_s"], row.limits["r_pc"]]
        words.append((name, row))
    good = [row.found >= float(row.published or 0.0) for row in known]
    return Statement(
        "Planar, camera's mounting wrong, too: combinations 2 and 13 are stable throughout.",
        ", ".join(f"{name} up to {row.published:g} deg" for name, row in words),
        ", ".join(f"{name} up to {row.found:.1f} deg" for name, row in words),
        verdict(all(good), any(good)),
        "Proven for all values in the boxes by the closed form.",
    )


def smaller_range(rows: FoundRows) -> Statement:
    """III i."""
    some = rows.of(PLANAR_ROBOT, "place")
    return Statement(
        "Planar III i: the smaller the range of displacement, the larger the tolerated error of "
        "the platform's place.",
        "in figure 3.2",
        pairs(some, "place", "m"),
        verdict(falls(found(some)), found(some)[-1] < found(some)[0]),
        NESTED,
    )


def difference_of_errors(rows: FoundRows) -> Statement:
    """III ii."""
    some = rows.of(PLANAR_ROBOT, "error")
    below = [row.found < row.limits["error"] for row in some]
    return Statement(
        "Planar III ii: the difference between e and its estimate must always be smaller than e.",
        "always",
        "largest difference " + pairs(some, "error", "m"),
        verdict(all(below)),
        "No such condition is in the criterion: with e = 0 it allows a difference of up to 2 m "
        "(3.12), and with a longer e less, because e multiplies the other errors. So the condition "
        "is met where e is long, and not needed where it is short.",
    )


def planar_camera_place(rows: FoundRows) -> Statement:
    """III iii."""
    some = rows.of(PLANAR_ROBOT, "camera")
    turned = [row.found for row in some if not row.limits["camera x"]]
    limits = found(some)
    words = ", ".join(
        f"{row.name.removeprefix('planar-III-camera-').replace('-', ' ')} {row.found:g}"
        for row in some
    )
    return Statement(
        "Planar III iii: place and turn of the camera on the platform have no effect.",
        "none",
        f"largest error of the platform's place: {words} [m]",
        verdict(max(limits) == min(limits), max(turned) == min(turned)),
        "A turn only turns e, which may have any direction. A place adds to e in L Ad^-1, as if e "
        "were longer by up to 0.08 m: no effect without errors of the robot's model, a small one "
        "with them.",
    )


def camera_error(rows: FoundRows) -> Statement:
    """III iv."""
    fine, coarse = rows.of(PLANAR_ROBOT, "r_pc"), rows.of(PLANAR_ROBOT, "r_pc coarse")
    gains = [some[0].found / max(some[-1].found, 1e-9) for some in (fine, coarse)]
    return Statement(
        "Planar III iv: a smaller error of the camera's place often allows a significantly larger "
        "range of the platform's rotation.",
        "often",
        f"{pairs(coarse, 'r_pc', 'm')} with the rest known coarsely; {pairs(fine, 'r_pc', 'm')} "
        "with the rest known well",
        verdict(min(gains) > SIGNIFICANT, max(gains) > SIGNIFICANT),
        "It matters where the other errors leave little margin.",
    )


def anchor_error(rows: FoundRows) -> Statement:
    """III v."""
    some = rows.of(PLANAR_ROBOT, "r_B")
    return Statement(
        "Planar III v: smaller errors of the anchor points allow larger errors of the platform's "
        "rotation.",
        "in figure 3.2",
        pairs(some, "r_B", "m"),
        verdict(falls(found(some)), found(some)[-1] < found(some)[0]),
        NESTED,
    )


def rotation(rows: FoundRows) -> Statement:
    """III vi."""
    some = rows.of(PLANAR_ROBOT, "psi")
    limits = found(some)
    closer = falls(limits)
    return Statement(
        "Planar III vi: with small errors and away from the limits of the workspace the platform "
        "may rotate up to 46 deg; the closer to the middle, the more.",
        f"{ROTATION:g} deg",
        pairs(some, "place", "m"),
        verdict(closer and limits[0] < 1.1 * ROTATION, closer and limits[0] >= ROTATION),
        "46 deg are stable up to the limits of the workspace, and more than that nearer to the "
        "middle.",
    )


CHECKS = (
    vision_alone, combinations, smaller_range, difference_of_errors, planar_camera_place,
    camera_error, anchor_error, rotation,
)  # fmt: skip
"""All of them, in the order of the thesis."""
