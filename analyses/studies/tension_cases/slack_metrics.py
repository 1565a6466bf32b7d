"""Numbers of runs that begin with slack cables, from their traces."""

from __future__ import annotations

from functools import partial

import numpy as np

from cdpr_drake.analyses.studies.framework.case_run import OwnMetric
from cdpr_drake.arrays import Array

SETTLED = 2.0
"""Time after which slack of the start should be gone [s]."""

STILL = 1.0
"""Length of the end of a run in which nothing should chatter any more [s]."""


def time_to_taut(traces: dict[str, Array], threshold: float) -> float:
    """Time at which the last of the cables pulls that were slack at the start [s].

    A cable pulls from a tension of `threshold` [N] on. Of those that never pull, infinity; 0 where
    none was slack.
    """
    slack = np.flatnonzero(traces["tensions"][0] < threshold)
    pulls = traces["tensions"][:, slack] >= threshold
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


def least_margin_taut(traces: dict[str, Array], threshold: float) -> float:
    """Least margin of the criterion once every cable that was slack at the start has pulled [-].

    NaN for a run in which one of them never does.
    """
    late = traces["stability_margin"][traces["stability_time"] >= time_to_taut(traces, threshold)]
    return float(np.min(late)) if len(late) else float("nan")


def winch_work(traces: dict[str, Array]) -> float:
    """Work of all winches, pulled and held back alike: integral of |t dl0/dt| [J]."""
    wound = np.abs(np.diff(traces["unstrained_lengths"], axis=0))
    pulled = 0.5 * (traces["tensions"][1:] + traces["tensions"][:-1])
    return float(np.sum(wound * pulled))


def slack_time(traces: dict[str, Array]) -> float:
    """Share of the time in which at least one cable is slack [-]."""
    some = np.any(traces["slack"][:-1] > 0.0, axis=1)
    return float(np.sum(np.diff(traces["time"]) * some) / traces["time"][-1])


def feature_error(traces: dict[str, Array]) -> float:
    """Root mean square of the features' distance from where they should be, while seen [-]."""
    return float(np.sqrt(np.nanmean(np.sum(traces["error"] ** 2, axis=1))))


def cable_power(traces: dict[str, Array]) -> float:
    """That work per time, the mean over the run [W]."""
    return winch_work(traces) / float(traces["time"][-1] - traces["time"][0])


def estimate_at_end(traces: dict[str, Array]) -> float:
    """Distance of the platform's estimate from the truth at the end [m]."""
    return float(traces["estimate_distance"][-1])


def estimate_angle_at_end(traces: dict[str, Array]) -> float:
    """Angle of the platform's estimate from the truth at the end [rad]."""
    return float(traces["estimate_angle"][-1])


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


def slack_metrics(threshold: float) -> dict[str, OwnMetric]:
    """What is reported of slack, beside what every case study reports.

    Args:
        threshold: Tension from which a cable counts as taut [N].
    """
    return {
        "time_to_taut_s": OwnMetric(
            "slack gone [s]", 1.0, ".2f", partial(time_to_taut, threshold=threshold)
        ),
        "underactuated_s": OwnMetric("underactuated [s]", 1.0, ".2f", underactuated_time),
        "least_rank_late": OwnMetric("least rank after 2 s", 1.0, ".0f", least_rank_late),
        "least_margin_late": OwnMetric("least margin after 2 s", 1.0, ".2f", least_margin_late),
        "least_margin_taut": OwnMetric(
            "least margin, slack gone", 1.0, ".2f", partial(least_margin_taut, threshold=threshold)
        ),
        "estimate_end_m": OwnMetric("estimate, end [mm]", 1e3, ".1f", estimate_at_end),
        "estimate_end_rad": OwnMetric(
            "estimate, end [deg]", 180.0 / np.pi, ".1f", estimate_angle_at_end
        ),
        "winch_work_j": OwnMetric("winch work [J]", 1.0, ".1f", winch_work),
        "cable_power_w": OwnMetric("cable power [W]", 1.0, ".2f", cable_power),
        "chatter_n": OwnMetric("chatter [N]", 1.0, ".2f", chatter),
        "correction_m": OwnMetric("correction [mm]", 1e3, ".0f", correction_travel),
    }
