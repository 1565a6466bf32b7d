"""Numbers of runs that begin with slack cables, from their traces."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

THRESHOLD = 1.0
"""Tension from which a cable counts as taut [N]."""

SETTLED = 2.0
"""Time after which slack of the start should be gone [s]."""

STILL = 1.0
"""Length of the end of a run in which nothing should chatter any more [s]."""


def time_to_taut(traces: dict[str, Array]) -> float:
    """Time at which the last of the cables pulls that were slack at the start [s].

    Of those that never pull, infinity; 0 where none was slack.
    """
    slack = np.flatnonzero(traces["tensions"][0] < THRESHOLD)
    pulls = traces["tensions"][:, slack] >= THRESHOLD
    if not np.all(np.any(pulls, axis=0)):
        return float("inf")
    first = np.argmax(pulls, axis=0)
    return float(np.max(traces["time"][first], initial=0.0))


def underactuated_time(traces: dict[str, Array]) -> float:
    """Time with a Jacobian of too small a rank, slack cables left out [s]."""
    times, rank = traces["stability_time"], traces["jacobian_rank"]
    return float(np.sum(np.diff(times) * (rank[:-1] < 6)))


def least_rank_late(traces: dict[str, Array]) -> float:
    """Smallest such rank after `SETTLED` [-]; NaN for a run that ended before."""
    late = traces["jacobian_rank"][traces["stability_time"] >= SETTLED]
    return float(np.min(late)) if len(late) else float("nan")


def least_margin_late(traces: dict[str, Array]) -> float:
    """Least margin of the stability criterion after `SETTLED` [-]; NaN as before."""
    late = traces["stability_margin"][traces["stability_time"] >= SETTLED]
    return float(np.min(late)) if len(late) else float("nan")


def winch_work(traces: dict[str, Array]) -> float:
    """Work of all winches, pulled and held back alike: integral of |t dl0/dt| [J]."""
    wound = np.abs(np.diff(traces["unstrained_lengths"], axis=0))
    pulled = 0.5 * (traces["tensions"][1:] + traces["tensions"][:-1])
    return float(np.sum(wound * pulled))


def mean_power(traces: dict[str, Array]) -> float:
    """`winch_work` over the duration of the run [W]."""
    return winch_work(traces) / float(traces["time"][-1])


def slack_time(traces: dict[str, Array]) -> float:
    """Share of the time in which at least one cable is slack [-]."""
    some = np.any(traces["slack"][:-1] > 0.0, axis=1)
    return float(np.sum(np.diff(traces["time"]) * some) / traces["time"][-1])


def feature_error(traces: dict[str, Array]) -> float:
    """Root mean square of the features' distance from where they should be, while seen [-]."""
    return float(np.sqrt(np.nanmean(np.sum(traces["error"] ** 2, axis=1))))


def estimate_at_end(traces: dict[str, Array]) -> float:
    """Distance of the platform's estimate from the truth at the end [m]."""
    return float(traces["estimate_distance"][-1])


def chatter(traces: dict[str, Array]) -> float:
    """Root mean square of the tensions about their means in the last `STILL` [N]."""
    late = traces["tensions"][traces["time"] >= traces["time"][-1] - STILL]
    return float(np.sqrt(np.mean((late - late.mean(axis=0)) ** 2)))


def correction_travel(traces: dict[str, Array]) -> float:
    """Length that the correction wound up in all, over all cables [m]; 0 without."""
    if "tension_corrections" not in traces:
        return 0.0
    steps = np.diff(traces["time"])[:, None]
    return float(-np.sum(steps * traces["tension_corrections"][:-1]))
