"""What the servoing thesis states about the planar robot, beside what was found."""

from __future__ import annotations

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CONSTRUCTION,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.stability_ranges.question import (
    FALLS,
    NESTED,
    PLANAR_ROBOT,
    PLANAR_VISION,
    ends_lower,
    falls,
    found,
    group,
    pairs,
    published,
)
from cdpr_drake.analyses.studies.stability_ranges.vision import PLANAR_NUMBERS

SECTION = "servoing thesis 3.2.1"

VISION_TOLERANCE = 2e-3
"""Twice the resolution of the limit of analysis I [m]."""

SIGNIFICANT = 1.1
"""An increase by this factor counts as significant."""

NOTHING = 0.01
"""What changes a limit by no more than this share has no effect on it: five steps of the search,
which tries a few errors by chance."""

ROTATION = 46.0
"""Rotation of the platform that the thesis found possible [deg]."""


@statement(
    "Planar, vision alone: stable while the object's place is off by less than 2 m.",
    "2 m, (3.12)",
    source=SECTION,
    rule=f"within {VISION_TOLERANCE:g} m",
    basis=CONSTRUCTION,
)
def vision_alone(runs: Runs) -> Finding:
    """Analysis I."""
    limit = found(group(runs, PLANAR_VISION, "I", 1).rows[0])
    return Finding(
        found=f"{limit:.3f} m",
        held=[abs(limit - 2.0) < VISION_TOLERANCE],
        why="Nearly by construction: where the robot is exact, the criterion is the printed "
        "condition. This tests how it is computed, not the robot.",
    )


@statement(
    "Planar, camera's mounting wrong, too: combinations 2 and 13 are stable throughout.",
    source=SECTION,
    rule="each up to the printed turn at least",
    cause=SOURCE,
)
def combinations(runs: Runs) -> Finding:
    """Combinations 2 and 13 of analysis II."""
    known = {
        PLANAR_NUMBERS[run["error_m"], run["r_s_m"], run["r_pc_m"]]: (found(run), limit)
        for run in group(runs, PLANAR_VISION, "II")
        if (limit := published(run)) is not None
    }
    return Finding(
        printed=", ".join(f"{name} up to {limit:g} deg" for name, (_, limit) in known.items()),
        found=", ".join(f"{name} up to {turn:.1f} deg" for name, (turn, _) in known.items()),
        held=[turn >= limit for turn, limit in known.values()],
        why="Proven for all values in the boxes by the closed form.",
    )


def falling(
    name: str, says: str, printed: str, *, section: str, which: str, limit: str, words: str = ""
) -> Check:
    """The larger a limit, the smaller what was found, which nesting all but implies."""
    unit = "deg about z" if limit == "psi" else "m"
    source = f"servoing thesis {section.partition(',')[0]}"

    @statement(says, printed, name=name, source=source, rule=FALLS, cause=SOURCE)
    def check(runs: Runs) -> Finding:
        some = group(runs, section, which)
        return Finding(
            found=words + pairs(some, limit, unit),
            held=[falls(some)],
            some=ends_lower(some),
            why=NESTED,
        )

    return check


smaller_range = falling(
    "smaller_range",
    "Planar III i: the smaller the range of displacement, the larger the tolerated error of the "
    "platform's place.",
    "in figure 3.2", section=PLANAR_ROBOT, which="place", limit="place",
)  # fmt: skip


@statement(
    "Planar III ii: the difference between e and its estimate must always be smaller than e.",
    "always",
    source=SECTION,
    rule="the largest difference that is found is smaller than e",
    cause=SOURCE,
)
def difference_of_errors(runs: Runs) -> Finding:
    """III ii."""
    some = group(runs, PLANAR_ROBOT, "error")
    return Finding(
        found="largest difference " + pairs(some, "error", "m"),
        held=[found(run) < run["error_m"] for run in some],
        some=False,
        why="No such condition is in the criterion: with e = 0 it allows a difference of up to 2 m "
        "(3.12), and with a longer e less, because e multiplies the other errors. So the condition "
        "is met where e is long, and not needed where it is short.",
    )


@statement(
    "Planar III iii: place and turn of the camera on the platform have no effect.",
    "none",
    source=SECTION,
    rule=f"limits for all places differ by at most {100.0 * NOTHING:g} %; for all turns in the "
    "middle",
    cause=SOURCE,
)
def planar_camera_place(runs: Runs) -> Finding:
    """III iii."""
    some = group(runs, PLANAR_ROBOT, "camera")
    moved, turned = some(camera_turn_deg=0.0), some(camera_x_m=0.0)
    spreads = [
        (max(values) - min(values)) / max(max(values), 1e-9)
        for values in (list(map(found, one)) for one in (moved, turned))
    ]
    words = ", ".join(
        f"{run.case.removeprefix('planar-III-camera-').replace('-', ' ')} {found(run):.4g}"
        for run in some
    )
    return Finding(
        found=f"largest error of the platform's place: {words} [m]; places change it by "
        f"{100.0 * spreads[0]:.1f} %, turns by {100.0 * spreads[1]:.1f} %",
        held=[spread <= NOTHING for spread in spreads],
        why="A turn only turns e, which may have any direction. A place adds to e in L Ad^-1, as "
        "if e were longer by up to 0.08 m: no effect without errors of the robot's model, a small "
        "one with them.",
    )


@statement(
    "Planar III iv: a smaller error of the camera's place often allows a significantly larger "
    "range of the platform's rotation.",
    "often",
    source=SECTION,
    rule=f"by a factor above {SIGNIFICANT:g}, with the rest known well and coarsely",
    cause=SOURCE,
)
def camera_error(runs: Runs) -> Finding:
    """III iv."""
    fine, coarse = (group(runs, PLANAR_ROBOT, name) for name in ("r_pc", "r_pc coarse"))
    gains = [found(some.rows[0]) / max(found(some.rows[-1]), 1e-9) for some in (fine, coarse)]
    return Finding(
        found=f"{pairs(coarse, 'r_pc', 'm')} with the rest known coarsely; "
        f"{pairs(fine, 'r_pc', 'm')} with the rest known well",
        held=[gain > SIGNIFICANT for gain in gains],
        why="It matters where the other errors leave little margin; limits of the thesis' "
        "combinations are not printed.",
    )


anchor_error = falling(
    "anchor_error",
    "Planar III v: smaller errors of the anchor points allow larger errors of the platform's "
    "rotation.",
    "in figure 3.2", section=PLANAR_ROBOT, which="r_B", limit="r_B",
)  # fmt: skip


@statement(
    "Planar III vi: with small errors and away from the limits of the workspace the platform may "
    "rotate up to 46 deg; the closer to the middle, the more.",
    f"{ROTATION:g} deg",
    source=SECTION,
    rule=f"closer to the middle: {FALLS}; in the middle below 1.1 times the printed turn",
    cause=SOURCE,
)
def rotation(runs: Runs) -> Finding:
    """III vi."""
    some = group(runs, PLANAR_ROBOT, "psi")
    middle, closer = found(some.rows[0]), falls(some)
    return Finding(
        found=pairs(some, "place", "m"),
        held=[closer, middle < 1.1 * ROTATION],
        some=closer and middle >= ROTATION,
        why="46 deg are stable up to the limits of the workspace, and more than that nearer to the "
        "middle.",
    )


CHECKS = (
    vision_alone, combinations, smaller_range, difference_of_errors, planar_camera_place,
    camera_error, anchor_error, rotation,
)  # fmt: skip
"""All of them, in the order of the thesis."""
