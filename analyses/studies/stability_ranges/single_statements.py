"""What 3.4.2 states about single wrong parameters, beside what was found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdpr_drake.analyses.reporting.statements import Statement, verdict
from cdpr_drake.analyses.studies.stability_ranges.answers import FoundRows
from cdpr_drake.analyses.studies.stability_ranges.item import SINGLE, RangeRow
from cdpr_drake.analyses.studies.stability_ranges.single_errors import (
    FULL_VOLUME,
    KNOWN,
    LOWER_CORNER,
    NO_TURN,
)

EMPTY_SHARE, HALF_TOLERANCE = 0.01, 0.25
"""Share that counts as nothing, and distance from one half that counts as about half."""

VOLUME_TOLERANCE = 0.05
"""Volumes that differ by less than this, five per cent of all, count as met [m^3]."""


def mean_difference(rows: Sequence[RangeRow], answer: str) -> float:
    """Mean absolute difference of an answer to the published volumes [m^3]."""
    pairs = [(row.answers[answer], row.published) for row in rows if row.published is not None]
    return float(np.mean([abs(a - b) for a, b in pairs]))


def _full(volume: float) -> bool:
    return volume > (1.0 - EMPTY_SHARE) * FULL_VOLUME


def single_camera_place(rows: FoundRows) -> Statement:
    """r_pc."""
    some = rows.of(SINGLE, "r_pc")
    every = [volume for row in some for volume in row.answers.values()]
    return Statement(
        "One wrong parameter: the error of the camera's place changes nothing, even 1 m.",
        "1.014 m^3 at 0.2 m and 1 m",
        f"{min(every):.3f} m^3 at least, by every verdict, certified included",
        verdict(all(map(_full, every))),
        "The limit is 2 m, as for the object's place.",
    )


def camera_turn(rows: FoundRows) -> Statement:
    """d_theta_pc."""
    low, middle, high = rows.of(SINGLE, "d_theta_pc_deg", 3)
    sampled = [row.answers["sampled"] for row in (low, middle, high)]
    met = [
        _full(sampled[0]),
        abs(sampled[1] / FULL_VOLUME - 0.5) < HALF_TOLERANCE,
        sampled[2] < EMPTY_SHARE * FULL_VOLUME,
    ]
    return Statement(
        "The camera may be turned by 40 deg; 55 deg leave about half of the workspace, 65 deg "
        "nothing.",
        "1.014, 0.514, 0 m^3",
        ", ".join(f"{volume:.3f}" for volume in sampled) + " m^3 sampled; at 55 deg "
        f"{middle.answers['searched']:.3f} searched, {middle.answers[LOWER_CORNER]:.3f} sampled "
        "with the target of the tables of 3.3",
        verdict(all(met), any(met)),
        "It depends on the target, which the thesis does not give: the longer e, the smaller.",
    )


def seen_object(rows: FoundRows) -> Statement:
    """r_s and d_theta_s."""
    (place,), (turn,) = rows.of(SINGLE, "r_s", 1), rows.of(SINGLE, "d_theta_s_deg", 1)
    volumes = [place.answers["sampled"], turn.answers["sampled"]]
    return Statement(
        "The workspace does not depend on errors of the feature vector, up to 0.5 m and 90 deg.",
        "1.014 m^3 both",
        f"0.5 m: {volumes[0]:.3f}; 90 deg: {volumes[1]:.3f} with half a turn to go, "
        f"{turn.answers[NO_TURN]:.3f} with none, {turn.answers[KNOWN]:.3f} if L_s = L_s_hat m^3",
        verdict(all(map(_full, volumes)), any(map(_full, volumes))),
        "With half a turn to go, any rotation error may turn theta u around. The thesis' result "
        "needs theta u near 0, or a criterion in which the object's errors do not appear.",
    )


def robot_errors(rows: FoundRows) -> Statement:
    """Everything else."""
    groups = ("r_A", "r_B", "d_theta_bp_deg", "r_bp")
    some = [row for group in groups for row in rows.of(SINGLE, group)]
    close = [
        abs(row.answers["sampled"] - float(row.published or 0.0)) < VOLUME_TOLERANCE for row in some
    ]
    return Statement(
        "Volumes with one error of exit points, anchor points, the platform's orientation or "
        "place.",
        ", ".join(f"{row.published:.3f}" for row in some) + " m^3",
        ", ".join(f"{row.answers['sampled']:.3f}" for row in some) + " m^3 sampled, mean "
        f"difference {mean_difference(some, 'sampled'):.3f}; "
        f"{mean_difference(some, LOWER_CORNER):.3f} with the target of the tables of 3.3",
        verdict(all(close), any(close)),
        f"{sum(close)} of {len(close)} within {VOLUME_TOLERANCE:g} m^3. Points are wrong each "
        "in its own direction; in their own cubes they leave less (table).",
    )


CHECKS = (single_camera_place, camera_turn, seen_object, robot_errors)
"""All of them, in the order of the thesis."""
