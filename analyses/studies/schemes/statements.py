"""What is said of schemes of visual servoing, and whether it holds here."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, SOURCE, Finding, statement
from cdpr_drake.analyses.studies.schemes.trials import FREE, ROBOT, TURNS, TURNS_DEG

FAR = 0.1
"""Retreat beyond which a camera on a robot would have left its workspace [m]."""

TEXTBOOK = (
    "The sentence repeats the literature, without a robot, a start or a number; the starts here "
    "were drawn."
)
"""Why it need not hold of these."""

STAYS = 0.005
"""Retreat that counts as none [m]."""

KEPT = 1.05
"""Share of its bound that L_P or L_I may reach: first-order foresight over one step, and what a
bound is left by till the least time between two switches is over."""


def column(runs: Runs, trial: str, scheme: str, name: str) -> np.ndarray:
    """A column of a scheme's runs, shape (n,)."""
    return runs(trial=trial, scheme=scheme)[name]


def _failed(runs: Runs, trial: str, scheme: str) -> str:
    arrived, lost = (column(runs, trial, scheme, name) for name in ("arrived", "lost"))
    short = int(np.sum(~arrived & ~lost))
    return f"{int(np.sum(lost))} lost and {short} not there of {len(lost)}"


def _worst_retreat(runs: Runs, scheme: str) -> float:
    return float(np.max(column(runs, TURNS, scheme, "retreat_m")))


@statement(
    "IBVS is not suited for large-scale motion, because it can get stuck in a local minimum.",
    rule=f"it retreats by more than {FAR:g} m; a turn does not arrive; a drawn start that keeps "
    "the target does not arrive; in part: the first",
    cause=SOURCE,
)
def image_far(runs: Runs) -> Finding:
    """Retreats of image-based servoing, and where it stays."""
    retreats = column(runs, TURNS, "ibvs", "retreat_m")
    ends = column(runs, TURNS, "ibvs", "arrived")
    beyond = [angle for angle, retreat in zip(TURNS_DEG, retreats, strict=True) if retreat > FAR]
    kept = ~column(runs, FREE, "ibvs", "lost")
    stuck = bool(np.any(kept & ~column(runs, FREE, "ibvs", "arrived")))
    since = f"from {min(beyond)} deg" if beyond else "at none"
    return Finding(
        found=f"turns about the optical axis: the camera retreats by more than {FAR:g} m {since}, "
        f"by {retreats[-2]:.2g} m at {TURNS_DEG[-2]} deg; at {TURNS_DEG[-1]} deg it "
        f"{'arrives' if ends[-1] else 'does not come back'}, where PBVS retreats by "
        f"{_worst_retreat(runs, 'pbvs'):.1g} m. Drawn starts of a free camera: "
        f"{_failed(runs, FREE, 'ibvs')}",
        held=[bool(beyond), not np.all(ends), stuck],
        some=bool(beyond),
        why="where it does not come back, its points have run into the image's middle, at infinite "
        "distance; a local minimum at rest is what a drawn start that keeps the target and does "
        "not arrive would be",
    )


@statement(
    "PBVS controls no image: it may lose the target where the goal could be reached.",
    rule="by both, in a drawn start at least",
    basis=OURS,
)
def pose_loses(runs: Runs) -> Finding:
    """Losses of pose-based servoing."""
    names = ("pbvs", "pbvs-line")
    lost = [float(np.sum(column(runs, FREE, name, "lost"))) for name in names]
    words = "; ".join(f"{name} {_failed(runs, FREE, name)}" for name in names)
    return Finding(
        found=f"drawn starts of a free camera: {words}",
        held=[count > 0.0 for count in lost],
        why="its features are in space; the object's origin goes straight in the image by pbvs, "
        "but not its corners",
    )


@statement(
    "2 1/2 D visual servoing does not get stuck in local minima.",
    rule="all that keep the target arrive; in part: all but 5 %",
    cause=SOURCE,
    why=TEXTBOOK,
)
def hybrid_free_of_minima(runs: Runs) -> Finding:
    """Runs that kept their target and did not arrive."""
    every = [column(runs, trial, "2.5d", "arrived") for trial in (TURNS, FREE, ROBOT)]
    gone = [column(runs, trial, "2.5d", "lost") for trial in (TURNS, FREE, ROBOT)]
    short = [int(np.sum(~a & ~g)) for a, g in zip(every, gone, strict=True)]
    lost = [int(np.sum(g)) for g in gone]
    counts = [len(a) for a in every]
    return Finding(
        found=f"not there, of those that kept the target: {short[0]} of {counts[0] - lost[0]} "
        f"turns, {short[1]} of {counts[1] - lost[1]} drawn starts of a free camera, {short[2]} of "
        f"{counts[2] - lost[2]} of ACROBOT; target lost: {lost[0]}, {lost[1]}, {lost[2]}",
        held=[count == 0 for count in short],
        some=sum(short) < sum(counts) // 20,
    )


@statement(
    "The partitioned approach decouples motions along x and y from those along z.",
    rule=f"retreat on turns below {1e3 * STAYS:g} mm, and all arrive, with goals as published and "
    f"turned; from drawn starts below {FAR:g} m",
    cause=SOURCE,
)
def partition_decouples(runs: Runs) -> Finding:
    """Retreats of partitioned servoing."""
    names = ("partitioned", "partitioned, turned")
    worst = [_worst_retreat(runs, name) for name in names]
    arrived = [bool(np.all(column(runs, TURNS, name, "arrived"))) for name in names]
    drawn = float(np.max(column(runs, FREE, "partitioned", "retreat_m")))
    good = [
        retreat < STAYS and all_there for retreat, all_there in zip(worst, arrived, strict=True)
    ]
    good.append(drawn < FAR)
    words = "; ".join(
        f"{name} at most {retreat:.1g} m, {'all' if there else 'not all'} arrived"
        for name, retreat, there in zip(names, worst, arrived, strict=True)
    )
    return Finding(
        found=f"retreat on turns up to {TURNS_DEG[-1]} deg: {words}; ibvs "
        f"{_worst_retreat(runs, 'ibvs'):.3g} m. Drawn starts, tilted: at most {drawn:.2g} m, "
        f"{_failed(runs, FREE, 'partitioned')}, by ibvs {_failed(runs, FREE, 'ibvs')}",
        held=good,
        why="alpha and sigma change with the axis alone only where the camera looks at the target "
        "frontally",
    )


@statement(
    "Of partitioned servoing the first task is to keep the features in the field of view.",
    rule="the field halves the losses; in part: there are fewer",
    cause=SOURCE,
    why=TEXTBOOK,
)
def field_keeps_points(runs: Runs) -> Finding:
    """Losses with and without a field at the image's edges."""
    plain, field = (
        (np.sum(column(runs, FREE, name, "lost")), np.sum(column(runs, ROBOT, name, "lost")))
        for name in ("partitioned", "partitioned, field")
    )
    room = [
        float(np.median(column(runs, FREE, name, "room_px")))
        for name in ("partitioned", "partitioned, field")
    ]
    less = bool(sum(field) < sum(plain))
    return Finding(
        found=f"lost without and with a field at the edges: free camera {plain[0]:.0f} and "
        f"{field[0]:.0f} of {len(column(runs, FREE, 'partitioned', 'lost'))}, ACROBOT "
        f"{plain[1]:.0f} and {field[1]:.0f} of {len(column(runs, ROBOT, 'partitioned', 'lost'))}; "
        f"median of the least room to an edge {room[0]:.0f} and {room[1]:.0f} px",
        held=[bool(sum(field) <= 0.5 * sum(plain)), less],
        some=less,
    )


@statement(
    "The switching approach uses image-based and pose-based controllers one after the other, "
    "by some Lyapunov functions of theirs.",
    rule=f"bounds are kept within a share of {KEPT:g}; it arrives at the largest turn; ibvs does "
    "not; it switches; in part: one of the first two",
    cause=SOURCE,
    why=TEXTBOOK,
)
def switching_by_bounds(runs: Runs) -> Finding:
    """Shares of bounds, and switches."""
    shares = np.concatenate(
        [column(runs, trial, "switching", "bound_share") for trial in (TURNS, FREE, ROBOT)]
    )
    switched = {
        trial: int(np.sum(column(runs, trial, "switching", "switches") > 0.0))
        for trial in (TURNS, FREE, ROBOT)
    }
    kept = float(np.nanmax(shares)) <= KEPT
    there = bool(column(runs, TURNS, "switching", "arrived")[-1])
    alone = not column(runs, TURNS, "ibvs", "arrived")[-1]
    words = ", ".join(f"{count} of {what}" for what, count in switched.items())
    return Finding(
        found=f"runs with switches: {words}; largest share of a bound {np.nanmax(shares):.3f}; at "
        f"{TURNS_DEG[-1]} deg, where ibvs {'fails' if alone else 'arrives'}, it "
        f"{'arrives' if there else 'fails'}. Free camera: {_failed(runs, FREE, 'switching')}",
        held=[kept, there, alone, sum(switched.values()) > 0],
        some=kept or there,
    )


CHECKS = (
    image_far, pose_loses, hybrid_free_of_minima, partition_decouples, field_keeps_points,
    switching_by_bounds,
)  # fmt: skip
"""All of them."""
