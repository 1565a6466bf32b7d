"""What the servoing thesis says of the shapes of its workspaces, judged."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import FITTED, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.stability_shapes.items import (
    BASELINE,
    COMBINATIONS,
    PLANAR_FIGURE,
    SETS,
    TURNED_FIGURE,
    Shape,
)

ACROBOT_FIGURES = ("3.13", "3.20", "3.25")
"""The large platform of ACROBOT under PBVS, 2 1/2 D and IBVS."""

START, GOAL = np.array([0.107, -0.026, 0.35]), np.array([0.30, 0.25, 0.12])
"""First and desired position of case VII. Source: section 4.3.1 [m]."""

NEAR = 0.2
"""About 0.1 m around a point: within this [m]; planes are 0.1 m apart."""

TINY = 0.02
"""A workspace is tiny that has at most this share of the positions: 0.1 m either way along each
axis is 1 % of them."""

FLAT = 1.0 / 3.0
"""A workspace is almost flat whose height is at most this share of the baseline's."""


UNKNOWN_TARGET = (
    "The error e, which multiplies all others, follows from the servo's target, and that is not "
    "printed, nor how errors were drawn; those here were chosen on shares in the tables."
)
"""Why a workspace may have another shape."""

ORIENTATIONS = "A position counts that is stable unturned and turned by +-30 deg about x, y and z."
"""Of figure 4.2."""


def shape(runs: Runs, figure: str, panel: str = BASELINE) -> Shape:
    """The workspace of a panel."""
    return Shape(runs.one(figure=figure, panel=panel))


def _corners(one: Shape) -> bool:
    lowest = one.inside[:, :, 0]
    return bool(np.all(lowest[[0, 0, -1, -1], [0, -1, 0, -1]]))


@statement(
    "A wrong platform position makes the workspace lower, but its corners remain.",
    "section 3.3.5, all three schemes",
    rule="at r_bp = 0.5 m it is lower; corners of the lowest plane of the grid remain",
    cause=SOURCE,
    why=UNKNOWN_TARGET,
)
def corners_stay(runs: Runs) -> Finding:
    """Section 3.3.5 on r_bp."""
    some = {
        figure: (shape(runs, figure), shape(runs, figure, "r_bp=0.5")) for figure in ACROBOT_FIGURES
    }
    lower = [large.top() < base.top() for base, large in some.values()]
    stay = [_corners(large) for _, large in some.values()]
    return Finding(
        found="; ".join(
            f"figure {figure}: height {base.top():.2f} to {large.top():.2f} m, corners "
            f"{'remain' if kept else 'do not remain'}"
            for (figure, (base, large)), kept in zip(some.items(), stay, strict=True)
        ),
        held=[*lower, *stay],
        some=any(lower) and any(stay),
    )


@statement(
    "A wrong platform orientation makes the workspace like a pyramid or a cone.",
    "section 3.3.5, figure 3.20f most",
    rule="each plane holds no more than the one below it, the last less than half of the first",
    cause=SOURCE,
)
def pyramid(runs: Runs) -> Finding:
    """Section 3.3.5 on the platform's rotation."""
    names = {"3.13": "d_theta_bp=30 deg", "3.20": "d_theta_bp=20 deg", "3.25": "d_theta_bp=30 deg"}
    areas = {figure: shape(runs, figure, name).areas() for figure, name in names.items()}
    narrowing = []
    for one in areas.values():
        there = one[one > 0.0]
        narrowing.append(
            len(there) > 1 and bool(np.all(np.diff(there) <= 0.0)) and there[-1] < 0.5 * there[0]
        )
    return Finding(
        found="; ".join(
            f"figure {figure}: shares of the planes upwards "
            + ", ".join(f"{100.0 * a:.0f}" for a in one if a > 0.0)
            + " %"
            for figure, one in areas.items()
        ),
        held=narrowing,
        why="2 1/2 D at 20 deg: at 30 deg, the printed figure 3.20f, 0.03 % are printed, less than "
        "a cell of the grid.",
    )


@statement(
    "Wrong anchor points flatten the workspace towards the yz plane.",
    "section 3.3.5",
    rule="on average nearer to the yz plane than to the xz plane",
    cause=SOURCE,
    why=UNKNOWN_TARGET,
)
def flattens_to_yz(runs: Runs) -> Finding:
    """Section 3.3.5 on anchor points."""
    names = {"3.13": "r_B=0.03", "3.20": "r_B=0.02", "3.25": "r_B=0.03"}
    spans = {}
    for figure, name in names.items():
        points = np.abs(shape(runs, figure, name).points())
        spans[figure] = np.mean(points[:, :2], axis=0) if len(points) else np.zeros(2)
    good = [bool(x < y) for x, y in spans.values()]
    return Finding(
        found="; ".join(
            f"figure {figure}: mean distance from the yz plane {x:.3f} m, from the xz plane "
            f"{y:.3f} m"
            for figure, (x, y) in spans.items()
        ),
        held=good,
    )


@statement(
    "ACROBOT's workspace is reduced downwards, whatever the perturbation.",
    "section 3.3.3, figure 3.13",
    rule="each workspace is on average lower than the baseline",
    cause=SOURCE,
    why=UNKNOWN_TARGET,
)
def downward(runs: Runs) -> Finding:
    """Section 3.3.3 on ACROBOT."""
    base = shape(runs, "3.13")
    names = (
        "r_bp=0.1",
        "r_bp=0.5",
        "d_theta_bp=10 deg",
        "d_theta_bp=30 deg",
        "r_B=0.03",
        "r_A=0.1",
    )
    middle = float(np.mean(base.points()[:, 2]))
    heights = {}
    for name in names:
        points = shape(runs, "3.13", name).points()
        if len(points):
            heights[name] = float(np.mean(points[:, 2]))
    good = [height < middle for height in heights.values()]
    return Finding(
        found=f"mean height {middle:.2f} m at the baseline; "
        + ", ".join(f"{name} {height:.2f} m" for name, height in heights.items()),
        held=good or [False],
    )


@statement(
    "With exit points wrong by 0.1 m ACROBOT's workspace is tiny, about 0.1 m around the origin.",
    "figure 3.13i",
    rule=f"at most {100.0 * TINY:g} % of the positions, not empty; within {NEAR:g} m along each "
    "axis",
    cause=SOURCE,
)
def tiny(runs: Runs) -> Finding:
    """Figure 3.13i."""
    one = shape(runs, "3.13", "r_A=0.1")
    points, part = one.points(), float(np.mean(one.inside))
    far = np.max(np.abs(points), axis=0) if len(points) else np.zeros(3)
    return Finding(
        found=f"{len(points)} positions, {100.0 * part:.1f} %, as far as {far[0]:.2f}, "
        f"{far[1]:.2f}, {far[2]:.2f} m from it",
        held=[0.0 < part <= TINY, len(points) > 0 and bool(np.all(far <= NEAR))],
        why="Table A.10 leaves 0.3 % there, a few cells of the grid, and which these are hangs on "
        "the draws.",
    )


@statement(
    "On CAROCA a wrong platform position flattens the workspace, its height falls before its "
    "width; at 1 m it is almost flat.",
    "figure 3.15a to d",
    rule=f"at 1 m at most {FLAT:.2f} of the baseline's height; at 0.3 m less of the height is kept "
    "than of the lowest plane",
    cause=SOURCE,
)
def flat(runs: Runs) -> Finding:
    """Figure 3.15a to d."""
    base, some, large = (
        shape(runs, "3.15"),
        shape(runs, "3.15", "r_bp=0.3"),
        shape(runs, "3.15", "r_bp=1"),
    )
    heights = [one.top() for one in (base, some, large)]
    widths = [float(one.areas()[0]) for one in (base, some, large)]
    lower_first = heights[1] / heights[0] < widths[1] / max(widths[0], 1e-9)
    return Finding(
        found=f"height {', '.join(f'{h:.1f}' for h in heights)} m, share of the lowest plane "
        f"{', '.join(f'{100.0 * w:.0f}' for w in widths)} % at 0.03, 0.3 and 1 m",
        held=[heights[2] <= FLAT * heights[0], lower_first],
        some=lower_first,
        why=f"Planes are 0.3 m apart. {UNKNOWN_TARGET}",
    )


@statement(
    "On CAROCA a wrong camera orientation affects the workspace's width more severely.",
    "figures 3.15a, g, h",
    rule="camera turned by 20 deg: less of the lowest plane is kept than of the height, and than "
    "with the platform moved by 0.3 m",
    cause=SOURCE,
    why=UNKNOWN_TARGET,
)
def width_by_camera(runs: Runs) -> Finding:
    """Figure 3.15a, g, h."""
    base, turned, moved = (
        shape(runs, "3.15", panel) for panel in (BASELINE, "d_theta_pc=20 deg", "r_bp=0.3")
    )
    kept = {
        words: (one.top() / base.top(), float(one.areas()[0] / max(base.areas()[0], 1e-9)))
        for words, one in (("camera turned", turned), ("platform moved", moved))
    }
    (height, width), (_, other) = kept["camera turned"], kept["platform moved"]
    return Finding(
        found="; ".join(
            f"{words}: {100.0 * h:.0f} % of the height, {100.0 * w:.0f} % of the lowest plane kept"
            for words, (h, w) in kept.items()
        ),
        held=[width < height, width < other],
    )


@statement(
    "2 1/2 D has the larger workspace at 10 deg and with wrong exit points, PBVS at 30 deg and "
    "at r_bp = 0.5 m.",
    "81.8 and 75.5, 0.03 and 37.6, 11.1 and 29.1, 40.2 and 0.3 %",
    rule="the order of each pair, at least half of the printed difference apart",
    basis=FITTED,
    cause=SOURCE,
    why=UNKNOWN_TARGET,
)
def hybrid_falls_faster(runs: Runs) -> Finding:
    """Section 3.3.4."""
    names = ("d_theta_bp=10 deg", "d_theta_bp=30 deg", "r_bp=0.5", "r_A=0.1")
    shares = {
        name: (shape(runs, "3.20", name).share, shape(runs, "3.13", name).share) for name in names
    }
    printed = (81.8 - 75.5, 0.03 - 37.6, 11.1 - 29.1, 40.2 - 0.3)
    good = [
        (hybrid - pose) / difference >= 0.5
        for (hybrid, pose), difference in zip(shares.values(), printed, strict=True)
    ]
    return Finding(
        found=", ".join(f"{name} {a:.1f} and {b:.1f}" for name, (a, b) in shares.items()) + " %",
        held=good,
    )


@statement(
    "With combination 16 of figure 3.2 the planar workspace is almost full, with combination "
    "2 very limited.",
    "figure 3.10",
)
def combinations(runs: Runs) -> Finding:
    """Figure 3.10: what it shows is not printed; what is, is shown."""
    shares = {name: shape(runs, PLANAR_FIGURE, name).share for name in COMBINATIONS}
    return Finding(
        found=", ".join(f"{name} of figure 3.1 {share:.1f} %" for name, share in shares.items()),
        held=[],
        why="The numbers of these combinations are not printed, and cannot be read from the text. "
        "Computed are the two of figure 3.1 that are printed, in which neither platform nor points "
        "are wrong, for targets as far as the square is wide.",
    )


@statement(
    "The first position of case VII is within the workspaces of all four bounds.",
    "figure 4.2",
    rule="of each of the four",
    cause=SOURCE,
)
def start_inside(runs: Runs) -> Finding:
    """Section 4.3.1 on the first pose."""
    inside = {name: shape(runs, TURNED_FIGURE, name).holds(START) for name in SETS}
    return Finding(
        found=", ".join(
            f"{name} {'inside' if good else 'outside'}" for name, good in inside.items()
        ),
        held=list(inside.values()),
        why="Bounds: the least that hold the printed sets. " + ORIENTATIONS,
    )


@statement(
    "In two cases the desired position is outside of the workspace.",
    "figure 4.2",
    rule="of just two sets",
    cause=SOURCE,
)
def goal_outside_twice(runs: Runs) -> Finding:
    """Section 4.3.1 on the desired pose."""
    outside = [name for name in SETS if not shape(runs, TURNED_FIGURE, name).holds(GOAL)]
    return Finding(
        found=f"outside of {', '.join(outside) or 'none'}",
        held=[len(outside) == 2],
        some=0 < len(outside) < len(SETS),
        why=ORIENTATIONS,
    )


@statement(
    "The four workspaces are noticeably smaller than the baseline's; D2 and D3, with wrong "
    "points, have the smaller ones.",
    "figure 4.2",
    rule="the largest of D2 and D3 below the least of D1 and D4; all below the baseline",
    cause=SOURCE,
)
def points_make_smaller(runs: Runs) -> Finding:
    """Section 4.3.1 on sizes."""
    shares = {name: shape(runs, TURNED_FIGURE, name).share for name in (*SETS, BASELINE)}
    smaller = max(shares["D2"], shares["D3"]) < min(shares["D1"], shares["D4"])
    reduced = max(shares[name] for name in SETS) < shares[BASELINE]
    return Finding(
        found=", ".join(f"{name} {share:.1f} %" for name, share in shares.items()),
        held=[smaller, reduced],
        why=ORIENTATIONS + " The baseline's is without turns.",
    )


CHECKS = (
    downward, tiny, flat, width_by_camera, hybrid_falls_faster, corners_stay, pyramid,
    flattens_to_yz, combinations, start_inside, goal_outside_twice, points_make_smaller,
)  # fmt: skip
