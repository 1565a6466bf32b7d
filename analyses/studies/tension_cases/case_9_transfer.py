"""What the servoing thesis states of where slack goes in case study IX, and what that does."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from scipy.signal import find_peaks

from cdpr_drake.analyses.studies.framework.runs import MissingRuns, Run, Runs
from cdpr_drake.analyses.studies.framework.statement import (
    CONSTRUCTION,
    SOURCE,
    Check,
    Finding,
    statement,
)
from cdpr_drake.analyses.studies.tension_cases.case_9_statements import (
    SLACK_PLAIN,
    THRESHOLD,
    UNPRINTED,
    final_tensions,
    in_polygon,
)
from cdpr_drake.analyses.studies.tension_cases.slack_experiments import (
    CORRECTED,
    PLAIN,
    SLACKS_CM,
    listed,
    means,
    near,
    there,
)
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute, solution_space

SAME_LENGTH = 0.005
"""Lengths that differ by less lie upon each other in figure 5.11 [m]."""

SAME_SPEED = 0.01
"""The same of velocities, in the mean of a run, in figure 5.12 [m/s]."""

LATE = 25
"""Rows at the end of a run of which lengths are averaged."""

PEAK = 0.3
"""Share of the largest deviation that a spike rises above what is on either side of it."""


def pairs(runs: Runs, name: str, other: str) -> list[tuple[Run, Run]]:
    """Runs of two configurations with the same seed, so far as both are there."""
    by_seed = {run.seed: run for run in runs(configuration=other)}
    return [(run, by_seed[run.seed]) for run in runs(configuration=name) if run.seed in by_seed]


def longer_at_end(run: Run, other: Run) -> Array:
    """By how much cables of a run are longer than those of another at the end, shape (m,) [m]."""
    ends = [np.mean(r["unstrained_lengths"][-LATE:], axis=0) for r in (run, other)]
    return np.asarray(ends[0] - ends[1])


@statement(
    "Without correction C1, C2 of E5 and E9 end as long as in E1, C5 and C6 longer in "
    "proportion to the slack.",
    "figure 5.11",
    rule="As long: within a quarter of the slack; longer: by more than half of it.",
    cause=SOURCE,
    why=UNPRINTED,
)
def transferred(runs: Runs) -> Finding:
    """Whose cables the slack is in at the end."""
    found = {
        name: np.mean([longer_at_end(*pair) for pair in pairs(runs, name, "E1")], axis=0)
        for name in there(runs, ("E5", "E9"))
    }
    good = []
    for name, change in found.items():
        slack = SLACKS_CM[PLAIN.index(name)] / 100.0
        good.append(bool(np.all(np.abs(change[:2]) < 0.25 * slack)))
        good.append(bool(np.all(change[4:6] > 0.5 * slack)))
    return Finding(
        found="; ".join(
            f"{name} longer than E1 by {1e3 * d[0]:.0f}, {1e3 * d[1]:.0f} mm, C5, C6 by "
            f"{1e3 * d[4]:.0f}, {1e3 * d[5]:.0f} mm"
            for name, d in found.items()
        ),
        held=good,
    )


@statement(
    "With correction lengths and velocities of C5 and C6 in E6 and E10 stay those of E2: no "
    "slack comes to them.",
    "figures 5.11, 5.12",
    rule=f"The same: within {1e3 * SAME_LENGTH:g} mm and {1e3 * SAME_SPEED:g} mm/s.",
    cause=SOURCE,
    why=UNPRINTED,
)
def undisturbed(runs: Runs) -> Finding:
    """Whether the correction leaves other cables alone."""
    lengths, speeds = {}, {}
    for name in there(runs, ("E6", "E10")):
        apart, faster = [], []
        for run, other in pairs(runs, name, "E2"):
            n = min(len(run["time"]), len(other["time"]))
            change = {
                key: run[key][:n, 4:6] - other[key][:n, 4:6]
                for key in ("unstrained_lengths", "cable_velocities")
            }
            apart.append(float(np.max(np.abs(change["unstrained_lengths"]))))
            faster.append(float(np.mean(np.abs(change["cable_velocities"]))))
        lengths[name], speeds[name] = float(np.mean(apart)), float(np.mean(faster))
    good = [value < SAME_LENGTH for value in lengths.values()]
    good += [value < SAME_SPEED for value in speeds.values()]
    return Finding(
        found=f"largest difference of length {listed(lengths, 'mm', 1, 1e3)}; mean difference of "
        f"velocity {listed(speeds, 'mm/s', 1, 1e3)}",
        held=good,
    )


def from_middle(X_WP_row: Array, tensions: Array) -> float:
    """Distance in eta of tensions from the barycenter of their feasible polygon [N]."""
    _, eta, _ = in_polygon(X_WP_row, tensions)
    robot = load_robot("acrobot_large")
    problem = tension_problem(
        robot, pose_from_row(X_WP_row), limits=(THRESHOLD, 60.0),
        cables=robot.cable_set(pulleys=False),
    )  # fmt: skip
    particular, N = solution_space(problem)
    middle = N.T @ (distribute(problem, "barycenter").tensions - particular)
    return float(np.linalg.norm(eta - middle))


@statement(
    "With correction the tensions at the end are the farther from the barycenter the more "
    "slack there was; E2 is the closest.",
    "figure 5.14",
    cause=SOURCE,
)
def outward(runs: Runs) -> Finding:
    """How far from the middle of the polygon runs with correction end."""
    found = {
        name: float(
            np.mean([
                from_middle(run["X_WP"][-1], tensions)
                for run, tensions in zip(
                    runs(configuration=name), final_tensions(runs, name), strict=True
                )
            ])
        )
        for name in there(runs, CORRECTED)
    }  # fmt: skip
    if len(found) < 2:
        raise MissingRuns("one experiment alone shows no trend")
    growing = all(b > a for a, b in pairwise(found.values()))
    first = found.get("E2") == min(found.values())
    return Finding(
        found=listed(found, "N", 2), held=[growing, first], why=f"Distances in eta. {UNPRINTED}"
    )


@statement(
    "The residual of the tensions at the end is always lower with correction, lowest in E2.",
    "figure 5.15, table 5.1",
    cause=SOURCE,
)
def residuals(runs: Runs) -> Finding:
    """Whether tensions hold the platform better with correction."""
    found = {
        name: float(
            np.mean([
                in_polygon(run["X_WP"][-1], tensions)[2]
                for run, tensions in zip(
                    runs(configuration=name), final_tensions(runs, name), strict=True
                )
            ])
        )
        for name in there(runs, (*PLAIN, *CORRECTED))
    }  # fmt: skip
    lower = [
        found[b] < found[a]
        for a, b in zip(PLAIN, CORRECTED, strict=True)
        if a in found and b in found
    ]
    if not lower:
        raise MissingRuns("no pair of experiments")
    least = min(found, key=found.__getitem__)
    return Finding(
        found=f"{listed(found, 'N', 2)}; lower in {sum(lower)} of {len(lower)} pairs, lowest in "
        f"{least}",
        held=[all(lower), least == "E2"],
        some=any(lower),
        why="The printed table itself contradicts it (E8 1.63 > E7 1.09 N).",
    )


@statement(
    "Without slack the system is stable throughout, with and without correction.",
    "figure 5.18a",
    cause=SOURCE,
    why=UNPRINTED,
)
def without_slack(runs: Runs) -> Finding:
    """Whether the criterion holds where nothing was paid out."""
    least = {
        name: min(float(np.min(run["stability_margin"])) for run in runs(configuration=name))
        for name in there(runs, ("E1", "E2"))
    }
    good = [value > 0.0 for value in least.values()]
    return Finding(found=f"least margin of all runs {listed(least, '', 2)}", held=good)


@statement(
    "In E3 three cables are slack in the middle of the trajectory, at some moments four.",
    "figure 5.18b",
    rule=f"Slack below {THRESHOLD:g} N; the middle is all but the first and the last tenth; three "
    "for half of it at least, in the mean; four at some moment of each run.",
    cause=SOURCE,
    why=UNPRINTED,
)
def three_and_four(runs: Runs) -> Finding:
    """How many cables are slack in the middle of E3."""
    most, share = [], []
    for run in runs(configuration="E3"):
        slack = 8 - run["taut_cables"]
        middle = slice(len(slack) // 10, -len(slack) // 10)
        most.append(int(np.max(slack[middle])))
        share.append(float(np.mean(slack[middle] >= 3)))
    return Finding(
        found=f"three or more for {100 * np.mean(share):.0f} % of the middle (mean); the most "
        f"{min(most)} to {max(most)}",
        held=[float(np.mean(share)) >= 0.5, min(most) >= 4],
        some=max(most) >= 3,
    )


@statement(
    "While the platform is underactuated the criterion of stability is not fulfilled.",
    "section 5.3.1, figure 5.18",
    basis=CONSTRUCTION,
)
def no_criterion(runs: Runs) -> Finding:
    """Whether the criterion fails wherever too few cables pull."""
    rows = failing = 0
    for name in there(runs, (*PLAIN, *CORRECTED)):
        for run in runs(configuration=name):
            under = run["jacobian_rank"] < 6
            rows += int(np.sum(under))
            failing += int(np.sum(run["stability_margin"][under] <= 0.0))
    if not rows:
        raise MissingRuns("no run is underactuated")
    return Finding(
        found=f"at {failing} of {rows} moments with fewer than six independent cables",
        held=[failing == rows],
        some=failing > rows // 2,
        why="Pi has the rank of the Jacobian: where that is less than six, Pi leaves a twist x "
        "out, x' Pi x = 0, and is not positive definite, whatever else is so.",
    )


@statement(
    "The estimate's rotation is off by 2 deg at the end with correction, by 5 deg in E9.",
    "figure 5.17",
    cause=SOURCE,
)
def rotation(runs: Runs) -> Finding:
    """How far the estimate's rotation is off at the end."""
    with_it = means(runs, CORRECTED, "estimate_end_rad")
    last = (
        runs.mean("estimate_end_rad", configuration="E9")
        if runs.has(configuration="E9")
        else np.nan
    )
    degrees = np.degrees(list(with_it.values()))
    good = [bool(np.all([near(float(value), 2.0) for value in degrees]))]
    good.append(near(float(np.degrees(last)), 5.0))
    return Finding(
        found=f"with {listed({k: float(np.degrees(v)) for k, v in with_it.items()}, 'deg', 1)}; E9 "
        f"{np.degrees(last):.1f} deg",
        held=good,
        why="What the first estimate is off by is chosen, 1.5 deg.",
    )


def spikes(deviation: Array) -> int:
    """How many spikes a deviation has, shape (n,)."""
    seen = deviation[np.isfinite(deviation)]
    return len(find_peaks(seen, prominence=PEAK * np.max(seen))[0]) if len(seen) else 0


@statement(
    "Without correction the platform falls to another set of cables twice: the path in the "
    "image of E5, E7 and E9 has two spikes.",
    "figure 5.16",
    rule=f"A spike rises by {100 * PEAK:g} % of the largest deviation above what is beside it.",
    cause=SOURCE,
    why=UNPRINTED,
)
def two_spikes(runs: Runs) -> Finding:
    """How often the platform falls to other cables."""
    found = {
        name: [spikes(run["image_deviation"]) for run in runs(configuration=name)]
        for name in there(runs, SLACK_PLAIN[1:])
    }
    medians = {name: float(np.median(counts)) for name, counts in found.items()}
    return Finding(
        found=f"spikes (medians): {listed(medians, '')}",
        held=[m == 2.0 for m in medians.values()],
        some=any(m >= 2.0 for m in medians.values()),
    )


TRANSFER: Sequence[Check] = (
    transferred, undisturbed, outward, residuals, without_slack, three_and_four, no_criterion,
    rotation, two_spikes,
)  # fmt: skip
"""Judges of where slack goes, beside `case_9_statements.STATEMENTS`."""
