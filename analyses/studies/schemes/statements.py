"""What is said of schemes of visual servoing, and whether it holds here."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, evaluate_checks, verdict
from cdpr_drake.analyses.studies.schemes.trials import COLUMNS, TURNS
from cdpr_drake.arrays import Array

StudyData = Mapping[str, Mapping[str, Array]]

FAR = 0.1
"""Retreat beyond which a camera on a robot would have left its workspace [m]."""

STAYS = 0.005
"""Retreat that counts as none [m]."""

KEPT = 1.05
"""Share of its bound that L_P or L_I may reach: first-order foresight over one step, and what a
bound is left by till the least time between two switches is over."""

TURN, FREE, ROBOT = "turns", "free camera", "ACROBOT"
"""What is run."""


def task_name(what: str, variant: str) -> str:
    """Name of the task that runs a variant."""
    return f"{what}, {variant}"


def column(found: StudyData, what: str, variant: str, name: str) -> Array:
    """One of `COLUMNS` of the runs, shape (n,); KeyError where there are none yet."""
    return np.asarray(found[task_name(what, variant)]["runs"])[:, COLUMNS.index(name)]


def _failed(found: StudyData, what: str, variant: str) -> str:
    arrived, lost = (column(found, what, variant, name) for name in ("arrived", "lost"))
    short = int(np.sum((arrived == 0.0) & (lost == 0.0)))
    return f"{int(np.sum(lost))} lost and {short} not there of {len(lost)}"


def _worst_retreat(found: StudyData, variant: str) -> float:
    return float(np.max(column(found, TURN, variant, "retreat_m")))


def _image_far(found: StudyData) -> Statement:
    retreats = column(found, TURN, "ibvs", "retreat_m")
    ends = column(found, TURN, "ibvs", "arrived")
    beyond = [angle for angle, retreat in zip(TURNS, retreats, strict=True) if retreat > FAR]
    least = float(np.min(ends))
    kept = column(found, FREE, "ibvs", "lost") == 0.0
    stuck = bool(np.any(kept & (column(found, FREE, "ibvs", "arrived") == 0.0)))
    since = f"from {min(beyond)} deg" if beyond else "at none"
    return Statement(
        "IBVS is not suited for large-scale motion, because it can get stuck in a local minimum.",
        "",
        f"turns about the optical axis: the camera retreats by more than {FAR:g} m {since}, by "
        f"{retreats[-2]:.2g} m at {TURNS[-2]} deg; at {TURNS[-1]} deg it "
        f"{'arrives' if ends[-1] else 'does not come back'}, where PBVS retreats by "
        f"{_worst_retreat(found, 'pbvs'):.1g} m. Drawn starts of a free camera: "
        f"{_failed(found, FREE, 'ibvs')}",
        verdict(bool(beyond) and least == 0.0 and stuck, bool(beyond)),
        "where it does not come back, its points have run into the image's middle, at infinite "
        "distance; a local minimum at rest is what a drawn start that keeps the target and does "
        "not arrive would be",
    )


def _pose_loses(found: StudyData) -> Statement:
    names = ("pbvs", "pbvs-line")
    lost = [float(np.sum(column(found, FREE, name, "lost"))) for name in names]
    words = "; ".join(f"{name} {_failed(found, FREE, name)}" for name in names)
    return Statement(
        "PBVS controls no image: it may lose the target where the goal could be reached.",
        "",
        f"drawn starts of a free camera: {words}",
        verdict(min(lost) > 0.0, max(lost) > 0.0),
        "its features are in space; the object's origin goes straight in the image by pbvs, but "
        "not its corners",
    )


def _hybrid_free_of_minima(found: StudyData) -> Statement:
    every = [column(found, what, "2.5d", "arrived") for what in (TURN, FREE, ROBOT)]
    gone = [column(found, what, "2.5d", "lost") for what in (TURN, FREE, ROBOT)]
    short = [int(np.sum((a == 0.0) & (g == 0.0))) for a, g in zip(every, gone, strict=True)]
    lost = [int(np.sum(g)) for g in gone]
    counts = [len(a) for a in every]
    return Statement(
        "2 1/2 D visual servoing does not get stuck in local minima.",
        "",
        f"not there, of those that kept the target: {short[0]} of {counts[0] - lost[0]} turns, "
        f"{short[1]} of {counts[1] - lost[1]} drawn starts of a free camera, {short[2]} of "
        f"{counts[2] - lost[2]} of ACROBOT; target lost: {lost[0]}, {lost[1]}, {lost[2]}",
        verdict(sum(short) == 0, sum(short) < sum(counts) // 20),
    )


def _partition_decouples(found: StudyData) -> Statement:
    names = ("partitioned", "partitioned, turned")
    worst = [_worst_retreat(found, name) for name in names]
    arrived = [bool(np.all(column(found, TURN, name, "arrived"))) for name in names]
    drawn = float(np.max(column(found, FREE, "partitioned", "retreat_m")))
    good = [
        retreat < STAYS and all_there for retreat, all_there in zip(worst, arrived, strict=True)
    ]
    good.append(drawn < FAR)
    words = "; ".join(
        f"{name} at most {retreat:.1g} m, {'all' if there else 'not all'} arrived"
        for name, retreat, there in zip(names, worst, arrived, strict=True)
    )
    return Statement(
        "The partitioned approach decouples motions along x and y from those along z.",
        "",
        f"retreat on turns up to {TURNS[-1]} deg: {words}; ibvs {_worst_retreat(found, 'ibvs'):.3g}"
        f" m. Drawn starts, tilted: at most {drawn:.2g} m, {_failed(found, FREE, 'partitioned')}, "
        f"by ibvs {_failed(found, FREE, 'ibvs')}",
        verdict(all(good), any(good)),
        "alpha and sigma change with the axis alone only where the camera looks at the target "
        "frontally",
    )


def _field_keeps_points(found: StudyData) -> Statement:
    plain, field = (
        (np.sum(column(found, FREE, name, "lost")), np.sum(column(found, ROBOT, name, "lost")))
        for name in ("partitioned", "partitioned, field")
    )
    room = [
        float(np.median(column(found, FREE, name, "room_px")))
        for name in ("partitioned", "partitioned, field")
    ]
    less = bool(sum(field) < sum(plain))
    return Statement(
        "Of partitioned servoing the first task is to keep the features in the field of view.",
        "",
        f"lost without and with a field at the edges: free camera {plain[0]:.0f} and "
        f"{field[0]:.0f} of {len(column(found, FREE, 'partitioned', 'lost'))}, ACROBOT "
        f"{plain[1]:.0f} and {field[1]:.0f} of {len(column(found, ROBOT, 'partitioned', 'lost'))}; "
        f"median of the least room to an edge {room[0]:.0f} and {room[1]:.0f} px",
        verdict(bool(sum(field) <= 0.5 * sum(plain)) and less, less),
        "confirmed if the field halves the losses",
    )


def _switching_by_bounds(found: StudyData) -> Statement:
    shares = np.concatenate(
        [column(found, what, "switching", "bound_share") for what in (TURN, FREE, ROBOT)]
    )
    switched = {
        what: int(np.sum(column(found, what, "switching", "switches") > 0.0))
        for what in (TURN, FREE, ROBOT)
    }
    kept = float(np.nanmax(shares)) <= KEPT
    there = column(found, TURN, "switching", "arrived")[-1] == 1.0
    alone = column(found, TURN, "ibvs", "arrived")[-1] == 0.0
    words = ", ".join(f"{count} of {what}" for what, count in switched.items())
    return Statement(
        "The switching approach uses image-based and pose-based controllers one after the other, "
        "by some Lyapunov functions of theirs.",
        "",
        f"runs with switches: {words}; largest share of a bound {np.nanmax(shares):.3f}; at "
        f"{TURNS[-1]} deg, where ibvs {'fails' if alone else 'arrives'}, it "
        f"{'arrives' if there else 'fails'}. Free camera: {_failed(found, FREE, 'switching')}",
        verdict(kept and there and alone and sum(switched.values()) > 0, kept or there),
    )


CHECKS = (
    _image_far, _pose_loses, _hybrid_free_of_minima, _partition_decouples, _field_keeps_points,
    _switching_by_bounds,
)  # fmt: skip
"""All of them."""


def schemes_statements(found: StudyData, quick: bool = False) -> list[Statement]:
    """What holds, of all that was run.

    Args:
        found: Arrays of the finished tasks, by `task_name`.
        quick: Whether they are all that is coming, of the quick form.
    """
    return evaluate_checks(CHECKS, found, quick)
