"""What has to hold of planned motions."""

from __future__ import annotations

import numpy as np

from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.statement import OURS, Finding, statement
from cdpr_drake.analyses.studies.planning.paths import REACHED
from cdpr_drake.analyses.studies.planning.predictions import (
    COMPUTED_TORQUE,
    FAST,
    PREDICTIVE,
)

PATH, SWING, TRACK = "path", "swing", "track"
"""Kinds of motions: along a path, from rest to rest, tracked by predictive control."""

SWING_SHARE = 0.1
"""Of the swing, what input shaping may leave."""

AGREEMENT = 0.01
"""Largest difference of times."""

MOSTLY = 0.97
"""Share of the instants at which a limit must be reached; the others lie within the interval of
two stations in which the motion switches from one limit to another."""


@statement(
    "the simulated robot keeps every limit at every step of control (1 kHz)",
    rule="no step without tensions, no limit missed by more than rounding",
    basis=OURS,
)
def keeps_limits(runs: Runs) -> Finding:
    """Plans tracked with feedback."""
    paths = runs(kind=PATH)
    return Finding(
        found=f"{paths.total('keeps_limits')} of {len(paths)}; largest share of a limit "
        f"{paths.largest('tracked_share'):.4f}",
        held=paths["keeps_limits"].tolist(),
        printed=f"{len(paths)} of {len(paths)}",
    )


@statement(
    "a limit is reached at every instant but where it switches",
    f">= {MOSTLY:.0%} of all instants",
    rule=f"reached: from {REACHED:.0%} of a limit on",
    basis=OURS,
)
def limit_reached(runs: Runs) -> Finding:
    """How often a plan is at a limit."""
    reached = runs(kind=PATH)["reached"]
    return Finding(
        found=f"{min(reached):.1%} to {max(reached):.1%}", held=(reached >= MOSTLY).tolist()
    )


@statement(
    "the time is that of a convex program (Verscheure et al., 2009)",
    f"within {AGREEMENT:.0%}",
    basis=OURS,
)
def convex_time(runs: Runs) -> Finding:
    """Plans beside another author's program."""
    paths = runs(kind=PATH)
    apart, first = np.abs(paths["difference"]), paths.rows[0]
    return Finding(
        found=f"within {max(apart):.3%}",
        held=(apart <= AGREEMENT).tolist(),
        why=f"{first['intervals']} intervals; {first['stations']} stations",
    )


@statement(
    "input shaping (ZVD) takes the swing away, on the simulated robot",
    f"at most {SWING_SHARE:.0%} left",
    basis=OURS,
)
def swing_left(runs: Runs) -> Finding:
    """What input shaping leaves of the swing."""
    shares = [left["ZVD"] / left["none"] for left in runs(kind=SWING).list("left_m")]
    return Finding(
        found=f"{min(shares):.2%} to {max(shares):.2%} left of {len(shares)}",
        held=[share <= SWING_SHARE for share in shares],
    )


@statement(
    "multiple shooting through the compiled engine leaves less swing than ZVD, and sooner, "
    "on the stiffness that it was planned with",
    "in every case",
    rule="less swing and an earlier end",
    basis=OURS,
)
def shooting(runs: Runs) -> Finding:
    """Multiple shooting beside input shaping: swing and time."""
    swings = runs(kind=SWING)
    return Finding(
        found="; ".join(map(_shot_words, swings)),
        held=[
            "shooting" in run["left_m"]
            and all(run[name]["shooting"] < run[name]["ZVD"] for name in ("left_m", "end_times_s"))
            for run in swings
        ],
        why="a cable that gets slack on the way is no motion that differences can follow",
    )


def _shot_words(run: Run) -> str:
    if "shooting" not in run["left_m"]:
        return f"{run['motion']}: none, {run['refused']['shooting'].rpartition(', in')[2]}"
    left, ends, off = run["left_m"], run["end_times_s"], run["off_m"]
    names = [name for name in ("shooting", "robust shooting", "ZVD") if name in off]
    return (
        f"{run['motion']}: {1e3 * left['shooting']:.2g} mm after {ends['shooting']:.3g} s, "
        f"ZVD {1e3 * left['ZVD']:.2g} mm after {ends['ZVD']:.3g} s; stiffness 10 % off: "
        + ", ".join(f"{name} {1e3 * off[name]:.2g} mm" for name in names)
    )


@statement(
    "where the cables cannot give a quintic motion, predictive control stays nearer to it "
    "than computed torque, with tensions at every step",
    "at every horizon",
    rule="smaller rms distance, no step without tensions",
    basis=OURS,
)
def foresight(runs: Runs) -> Finding:
    """A motion that is too fast for the cables."""
    fast = runs(kind=TRACK, duration_s=FAST)
    plain = fast.one(controller=COMPUTED_TORQUE)
    ahead = fast(controller=PREDICTIVE)
    return Finding(
        found=f"rms {1e3 * plain['rms_m']:.3g} mm, {plain['failures']} steps without tensions; "
        + ", ".join(f"{run['steps']} steps ahead {1e3 * run['rms_m']:.3g} mm" for run in ahead),
        held=[run["rms_m"] < plain["rms_m"] and run["failures"] == 0 for run in ahead],
    )


CHECKS = (keeps_limits, limit_reached, convex_time, swing_left, shooting, foresight)
