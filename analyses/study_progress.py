"""Where a study stands."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StudyProgress:
    """Where a study stands.

    Attributes:
        what: What it is doing, in a few words.
        done: Work done, in simulated time [s].
        total: All work, the same [s].
        wall_time: Time since it began [s].
    """

    what: str
    done: float
    total: float
    wall_time: float
