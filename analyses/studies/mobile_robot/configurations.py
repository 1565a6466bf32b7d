"""What the study runs: estimators, correction or none, and what is not printed, three values."""

from __future__ import annotations

from dataclasses import dataclass

from cdpr_drake.analyses.studies.mobile_robot.laps import LapsTask

SEEDS, QUICK_SEEDS = 10, 1

ALL_LAPS, QUICK_LAPS = 700, 2
"""Laps with tension correction."""

ESTIMATOR_LAPS, PLAIN_LAPS, VARIED_LAPS = 30, 60, 60
"""After so many laps runs end that have not failed."""

PLAIN = "tension_management=null"
NO_KNOWN_TAG = "estimator.known_tag=null"

PUBLISHED_LAPS = {
    "control_integration": 12,
    "cable_lengths": 2,
    "cable_lengths_elastic": 3,
    "cable_lengths_pulleys": 3,
    "cable_lengths_elastic_pulleys": 4,
}
"""Laps after which the thesis' estimators 1, 4, 5, 6 and 7 failed without a known tag, 2.3.7."""

NUMBERS = {
    "control_integration": 1, "cable_lengths": 4, "cable_lengths_elastic": 5,
    "cable_lengths_pulleys": 6, "cable_lengths_elastic_pulleys": 7,
}  # fmt: skip
"""Numbers of these estimators in the thesis."""

PUBLISHED_PLAIN = 29
"""Lap in which tracking failed without tension correction, 5.3.1."""

VARIED_ESTIMATORS = ("cable_lengths", "cable_lengths_elastic_pulleys")
"""Estimators, the simplest and the best by lengths, of which what is not printed is varied."""

_TRACK = "target.motion.mobile_robot"

VARIED: dict[str, tuple[str, tuple[str, ...], float]] = {
    "track smaller": (
        "track 0.20 x 0.12 m",
        (f"{_TRACK}.length=0.2", f"{_TRACK}.width=0.12", f"{_TRACK}.corner_radius=0.04"),
        1.0,
    ),
    "track larger": (
        "track 0.29 x 0.18 m",
        (f"{_TRACK}.length=0.29", f"{_TRACK}.width=0.18", f"{_TRACK}.corner_radius=0.06"),
        1.0,
    ),
    "friction none": ("no friction", (), 0.0),
    "friction more": ("friction x 3", (), 3.0),
    "offset less": ("winches run off by 0.5 mm/s", ("perturbations.winch_offset=0.0005",), 1.0),
    "offset more": ("winches run off by 2 mm/s", ("perturbations.winch_offset=0.002",), 1.0),
    "spread less": ("+- 0.1 mm/s", ("perturbations.winch_offset_spread=0.0001",), 1.0),
    "spread more": ("+- 0.4 mm/s", ("perturbations.winch_offset_spread=0.0004",), 1.0),
}
"""What is not printed, less and more than chosen: words, changes, friction."""


@dataclass(frozen=True)
class Configuration:
    """A configuration of the study.

    Attributes:
        name: Key in the results.
        words: For tables.
        task: What is run.
        published: What the thesis prints, in words; may be empty.
    """

    name: str
    words: str
    task: LapsTask
    published: str = ""


def configurations(quick: bool) -> list[Configuration]:
    """All of them, or the few of the quick form."""
    some = [
        Configuration(
            f"estimator {kind}",
            f"no known tag, estimator {NUMBERS[kind]}, {kind.replace('_', ' ')}",
            LapsTask(
                (PLAIN, NO_KNOWN_TAG, f"estimator.kind={kind}"),
                QUICK_LAPS if quick else ESTIMATOR_LAPS,
            ),
            f"fails after {laps} laps",
        )
        for kind, laps in PUBLISHED_LAPS.items()
        if not quick or kind == "cable_lengths"
    ]
    some += [
        Configuration(
            "plain", "no correction", LapsTask((PLAIN,), QUICK_LAPS if quick else PLAIN_LAPS),
            f"fails in lap {PUBLISHED_PLAIN}",
        ),
        Configuration(
            "corrected", "with correction", LapsTask((), QUICK_LAPS if quick else ALL_LAPS),
            "700 laps, never more than two cables slack",
        ),
    ]  # fmt: skip
    if quick:
        return some
    for name, (words, changes, friction) in VARIED.items():
        for other, correction in (("plain", (PLAIN,)), ("corrected", ())):
            some.append(
                Configuration(
                    f"{name}, {other}", f"{words}, {other}",
                    LapsTask((*changes, *correction), VARIED_LAPS, friction),
                )
            )  # fmt: skip
        for kind in VARIED_ESTIMATORS:
            some.append(
                Configuration(
                    f"{name}, estimator {kind}", f"{words}, estimator {NUMBERS[kind]}",
                    LapsTask(
                        (*changes, PLAIN, NO_KNOWN_TAG, f"estimator.kind={kind}"),
                        ESTIMATOR_LAPS, friction,
                    ),
                )
            )  # fmt: skip
    return some
