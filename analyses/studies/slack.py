"""Experiments E1 to E10 of cases IX and X: more and more slack at the start, and its numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from cdpr_drake.analyses.studies.servo import Configuration
from cdpr_drake.arrays import Array

Curves = Mapping[str, Array]

SLACKS_CM = (0, 2, 4, 6, 8)
"""Surplus of two cables at the start of E1 and E2, E3 and E4, ... [cm]."""

PLAIN = tuple(f"E{2 * k + 1}" for k in range(len(SLACKS_CM)))
CORRECTED = tuple(f"E{2 * k + 2}" for k in range(len(SLACKS_CM)))
"""Names of the experiments without and with correction, by slack."""

OFF = "tension_management=null"


def slack_change(centimetres: float, cables: Sequence[int], count: int = 8) -> str:
    """Pays out some cables, by their numbers from 1, at the start."""
    lengths = [centimetres / 100.0 if k + 1 in cables else 0 for k in range(count)]
    return f"perturbations.slack=[{', '.join(str(x) for x in lengths)}]"


def experiments(cables: Sequence[int], correction: str) -> tuple[Configuration, ...]:
    """E1 to E10, with the cables that are slack and the change that takes slack up."""
    return tuple(
        Configuration(
            name, f"{name}: {slack} cm{words}", (slack_change(slack, cables), change), "experiments"
        )
        for one, other, slack in zip(PLAIN, CORRECTED, SLACKS_CM, strict=True)
        for name, words, change in ((one, "", OFF), (other, ", corrected", correction))
    )


def time_to_taut(curves: Curves, threshold: float) -> float:
    """Time at which the last of the cables pulls that were slack at the start [s]: from `threshold`
    [N] on; infinity if one never does, 0 where none was slack."""
    slack = np.flatnonzero(curves["tensions"][0] < threshold)
    pulls = curves["tensions"][:, slack] >= threshold
    if not np.all(np.any(pulls, axis=0)):
        return float("inf")
    return float(np.max(curves["time"][np.argmax(pulls, axis=0)], initial=0.0))


def underactuated(curves: Curves) -> float:
    """Time with a Jacobian of too small a rank, slack cables left out [s]."""
    return float(np.sum(np.diff(curves["stability_time"]) * (curves["jacobian_rank"][:-1] < 6)))


def least_after(
    curves: Curves, name: str, time: float | None = None, threshold: float = 0.0
) -> float:
    """Least value of a curve of stability after a time [s], or once all cables that were slack have
    pulled; NaN for a run that ended before."""
    begin = time_to_taut(curves, threshold) if time is None else time
    late = curves[name][curves["stability_time"] >= begin]
    return float(np.min(late)) if len(late) else float("nan")


def winch_work(curves: Curves) -> float:
    """Work of all winches, pulled and held back alike: integral of |t dl0/dt| [J]."""
    wound = np.abs(np.diff(curves["unstrained_lengths"], axis=0))
    return float(np.sum(wound * 0.5 * (curves["tensions"][1:] + curves["tensions"][:-1])))


def cable_power(curves: Curves) -> float:
    """That work per time, the mean over the run [W]."""
    return winch_work(curves) / float(curves["time"][-1] - curves["time"][0])


def last_value(curves: Curves, name: str) -> float:
    """The last one of a curve."""
    return float(curves[name][-1])


def chatter(curves: Curves) -> float:
    """Root mean square of the tensions about their means in the last second [N]."""
    late = curves["tensions"][curves["time"] >= curves["time"][-1] - 1.0]
    return float(np.sqrt(np.mean((late - late.mean(axis=0)) ** 2)))


def correction_travel(curves: Curves) -> float:
    """Length that the correction wound up in all, over all cables [m]; 0 without."""
    if "tension_corrections" not in curves:
        return 0.0
    return float(-np.sum(np.diff(curves["time"])[:, None] * curves["tension_corrections"][:-1]))


def slack_metrics(threshold: float) -> dict[str, Callable[[Curves], float]]:
    """What is reported of slack; a cable is taut from a tension of `threshold` [N] on, and slack of
    the start should be gone after 2 s."""
    return {
        "time_to_taut_s": partial(time_to_taut, threshold=threshold),
        "underactuated_s": underactuated,
        "least_rank_late": partial(least_after, name="jacobian_rank", time=2.0),
        "least_margin_late": partial(least_after, name="stability_margin", time=2.0),
        "least_margin_taut": partial(least_after, name="stability_margin", threshold=threshold),
        "estimate_end_m": partial(last_value, name="estimate_distance"),
        "estimate_end_rad": partial(last_value, name="estimate_angle"),
        "winch_work_j": winch_work, "cable_power_w": cable_power, "chatter_n": chatter,
        "correction_m": correction_travel,
    }  # fmt: skip
