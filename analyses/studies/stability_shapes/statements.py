"""What the servoing thesis says of the shapes of its workspaces, judged."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from cdpr_drake.analyses.reporting.statements import (
    NOT_TESTABLE,
    Statement,
    evaluate_checks,
    verdict,
)
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

FLAT = 1.0 / 3.0
"""A workspace is almost flat whose height is at most this share of the baseline's."""


class FoundShapes:
    """Workspaces by figure and panel; KeyError where there is none."""

    def __init__(self, shapes: Iterable[Shape]) -> None:
        """With those that were finished."""
        self._found = {(one.item.figure, one.item.name): one for one in shapes}

    def __call__(self, figure: str, name: str = BASELINE) -> Shape:
        """The workspace of a panel."""
        return self._found[figure, name]


def shape_statements(shapes: Sequence[Shape], quick: bool) -> list[Statement]:
    """Statements whose workspaces are there."""
    return evaluate_checks(CHECKS, FoundShapes(shapes), quick)


def _corners(shape: Shape) -> bool:
    lowest = shape.inside[:, :, 0]
    return bool(np.all(lowest[[0, 0, -1, -1], [0, -1, 0, -1]]))


def corners_stay(found: FoundShapes) -> Statement:
    """Section 3.3.5 on r_bp."""
    some = {figure: (found(figure), found(figure, "r_bp=0.5")) for figure in ACROBOT_FIGURES}
    lower = [large.top() < base.top() for base, large in some.values()]
    stay = [_corners(large) for _, large in some.values()]
    return Statement(
        "A wrong platform position makes the workspace lower, but its corners remain.",
        "section 3.3.5, all three schemes",
        "; ".join(
            f"figure {figure}: height {base.top():.2f} to {large.top():.2f} m, corners "
            f"{'remain' if kept else 'do not remain'}"
            for (figure, (base, large)), kept in zip(some.items(), stay, strict=True)
        ),
        verdict(all(lower) and all(stay), any(lower) and any(stay)),
        "At r_bp = 0.5 m; corners of the lowest plane of the grid.",
    )


def pyramid(found: FoundShapes) -> Statement:
    """Section 3.3.5 on the platform's rotation."""
    names = {"3.13": "d_theta_bp=30 deg", "3.20": "d_theta_bp=20 deg", "3.25": "d_theta_bp=30 deg"}
    areas = {figure: found(figure, name).areas() for figure, name in names.items()}
    narrowing = []
    for one in areas.values():
        there = one[one > 0.0]
        narrowing.append(
            len(there) > 1 and bool(np.all(np.diff(there) <= 0.0)) and there[-1] < 0.5 * there[0]
        )
    return Statement(
        "A wrong platform orientation makes the workspace like a pyramid or a cone.",
        "section 3.3.5, figure 3.20f most",
        "; ".join(
            f"figure {figure}: shares of the planes upwards "
            + ", ".join(f"{100.0 * a:.0f}" for a in one if a > 0.0)
            + " %"
            for figure, one in areas.items()
        ),
        verdict(all(narrowing), any(narrowing)),
        "A pyramid: each plane holds no more than the one below it, the last less than half of the "
        "first. 2 1/2 D at 20 deg: at 30 deg, the printed figure 3.20f, 0.03 % are printed, less "
        "than a cell of the grid.",
    )


def flattens_to_yz(found: FoundShapes) -> Statement:
    """Section 3.3.5 on anchor points."""
    names = {"3.13": "r_B=0.03", "3.20": "r_B=0.02", "3.25": "r_B=0.03"}
    spans = {}
    for figure, name in names.items():
        points = np.abs(found(figure, name).points())
        spans[figure] = np.mean(points[:, :2], axis=0) if len(points) else np.zeros(2)
    good = [bool(x < y) for x, y in spans.values()]
    return Statement(
        "Wrong anchor points flatten the workspace towards the yz plane.",
        "section 3.3.5",
        "; ".join(
            f"figure {figure}: mean distance from the yz plane {x:.3f} m, from the xz plane "
            f"{y:.3f} m"
            for figure, (x, y) in spans.items()
        ),
        verdict(all(good), any(good)),
    )


def downward(found: FoundShapes) -> Statement:
    """Section 3.3.3 on ACROBOT."""
    base = found("3.13")
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
        points = found("3.13", name).points()
        if len(points):
            heights[name] = float(np.mean(points[:, 2]))
    good = [height < middle for height in heights.values()]
    return Statement(
        "ACROBOT's workspace is reduced downwards, whatever the perturbation.",
        "section 3.3.3, figure 3.13",
        f"mean height {middle:.2f} m at the baseline; "
        + ", ".join(f"{name} {height:.2f} m" for name, height in heights.items()),
        verdict(bool(good) and all(good), any(good)),
    )


def tiny(found: FoundShapes) -> Statement:
    """Figure 3.13i."""
    points = found("3.13", "r_A=0.1").points()
    far = np.max(np.abs(points), axis=0) if len(points) else np.zeros(3)
    return Statement(
        "With exit points wrong by 0.1 m ACROBOT's workspace is tiny, about 0.1 m around the "
        "origin.",
        "figure 3.13i",
        f"{len(points)} positions, as far as {far[0]:.2f}, {far[1]:.2f}, {far[2]:.2f} m from it",
        verdict(len(points) > 0 and bool(np.all(far <= NEAR)), len(points) > 0),
        f"About: within {NEAR:g} m along each axis. Table A.10 leaves 0.3 % there, a few cells of "
        "the grid, and which these are hangs on the draws.",
    )


def flat(found: FoundShapes) -> Statement:
    """Figure 3.15a to d."""
    base, some, large = found("3.15"), found("3.15", "r_bp=0.3"), found("3.15", "r_bp=1")
    heights = [one.top() for one in (base, some, large)]
    widths = [float(one.areas()[0]) for one in (base, some, large)]
    return Statement(
        "On CAROCA a wrong platform position flattens the workspace, its height falls before its "
        "width; at 1 m it is almost flat.",
        "figure 3.15a to d",
        f"height {', '.join(f'{h:.1f}' for h in heights)} m, share of the lowest plane "
        f"{', '.join(f'{100.0 * w:.0f}' for w in widths)} % at 0.03, 0.3 and 1 m",
        verdict(
            heights[2] <= FLAT * heights[0]
            and heights[1] / heights[0] < widths[1] / max(widths[0], 1e-9),
            heights[1] / heights[0] < widths[1] / max(widths[0], 1e-9),
        ),
        f"Almost flat: at most {FLAT:.2f} of the baseline's height; planes are 0.3 m apart.",
    )


def width_by_camera(found: FoundShapes) -> Statement:
    """Figure 3.15a, g, h."""
    base, turned, moved = (
        found("3.15"), found("3.15", "d_theta_pc=20 deg"), found("3.15", "r_bp=0.3")
    )  # fmt: skip
    kept = {
        words: (one.top() / base.top(), float(one.areas()[0] / max(base.areas()[0], 1e-9)))
        for words, one in (("camera turned", turned), ("platform moved", moved))
    }
    (height, width), (_, other) = kept["camera turned"], kept["platform moved"]
    return Statement(
        "On CAROCA a wrong camera orientation affects the workspace's width more severely.",
        "figures 3.15a, g, h",
        "; ".join(
            f"{words}: {100.0 * h:.0f} % of the height, {100.0 * w:.0f} % of the lowest plane kept"
            for words, (h, w) in kept.items()
        ),
        verdict(width < height and width < other, width < height or width < other),
        "Camera turned by 20 deg, platform moved by 0.3 m.",
    )


def hybrid_falls_faster(found: FoundShapes) -> Statement:
    """Section 3.3.4."""
    names = ("d_theta_bp=10 deg", "d_theta_bp=30 deg", "r_bp=0.5", "r_A=0.1")
    shares = {name: (found("3.20", name).share, found("3.13", name).share) for name in names}
    larger = (True, False, False, True)
    good = [
        (hybrid > pose) == wanted
        for (hybrid, pose), wanted in zip(shares.values(), larger, strict=True)
    ]
    return Statement(
        "2 1/2 D has the larger workspace at 10 deg and with wrong exit points, PBVS at 30 deg and "
        "at r_bp = 0.5 m.",
        "81.8 and 75.5, 0.03 and 37.6, 11.1 and 29.1, 40.2 and 0.3 %",
        ", ".join(f"{name} {a:.1f} and {b:.1f}" for name, (a, b) in shares.items()) + " %",
        verdict(all(good), any(good)),
    )


def combinations(found: FoundShapes) -> Statement:
    """Figure 3.10: what it shows is not printed; what is, is shown."""
    shares = {name: found(PLANAR_FIGURE, name).share for name in COMBINATIONS}
    return Statement(
        "With combination 16 of figure 3.2 the planar workspace is almost full, with combination "
        "2 very limited.",
        "figure 3.10",
        ", ".join(f"{name} of figure 3.1 {share:.1f} %" for name, share in shares.items()),
        NOT_TESTABLE,
        "The numbers of these combinations are not printed, and cannot be read from the text. "
        "Computed are the two of figure 3.1 that are printed, in which neither platform nor points "
        "are wrong, for targets as far as the square is wide.",
    )


def start_inside(found: FoundShapes) -> Statement:
    """Section 4.3.1 on the first pose."""
    inside = {name: found(TURNED_FIGURE, name).holds(START) for name in SETS}
    return Statement(
        "The first position of case VII is within the workspaces of all four bounds.",
        "figure 4.2",
        ", ".join(f"{name} {'inside' if good else 'outside'}" for name, good in inside.items()),
        verdict(all(inside.values()), any(inside.values())),
        "Bounds: the least that hold the printed sets. " + ORIENTATIONS,
    )


def goal_outside_twice(found: FoundShapes) -> Statement:
    """Section 4.3.1 on the desired pose."""
    outside = [name for name in SETS if not found(TURNED_FIGURE, name).holds(GOAL)]
    return Statement(
        "In two cases the desired position is outside of the workspace.",
        "figure 4.2",
        f"outside of {', '.join(outside) or 'none'}",
        verdict(len(outside) == 2, 0 < len(outside) < len(SETS)),
        ORIENTATIONS,
    )


def points_make_smaller(found: FoundShapes) -> Statement:
    """Section 4.3.1 on sizes."""
    shares = {name: found(TURNED_FIGURE, name).share for name in (*SETS, BASELINE)}
    smaller = max(shares["D2"], shares["D3"]) < min(shares["D1"], shares["D4"])
    reduced = max(shares[name] for name in SETS) < shares[BASELINE]
    return Statement(
        "The four workspaces are noticeably smaller than the baseline's; D2 and D3, with wrong "
        "points, have the smaller ones.",
        "figure 4.2",
        ", ".join(f"{name} {share:.1f} %" for name, share in shares.items()),
        verdict(smaller and reduced, smaller or reduced),
        ORIENTATIONS + " The baseline's is without turns.",
    )


ORIENTATIONS = "A position counts that is stable unturned and turned by +-30 deg about x, y and z."

CHECKS = (
    downward, tiny, flat, width_by_camera, hybrid_falls_faster, corners_stay, pyramid,
    flattens_to_yz, combinations, start_inside, goal_outside_twice, points_make_smaller,
)  # fmt: skip
