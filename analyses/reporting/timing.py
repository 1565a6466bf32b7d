"""Timings as ratios within one run, since absolute times say little on another machine."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, asdict, dataclass
from typing import Any, TypeVar

Item = TypeVar("Item")


@dataclass(frozen=True)
class TimingRow:
    """One line of a benchmark.

    Attributes:
        name: What was timed.
        value: Its figure, the median over repeats.
        unit: Unit of `value` and `baseline_value`.
        baseline: What it is compared with.
        baseline_value: The baseline's figure in the same run.
        ratio: What the row is about: see `ratio_means`.
        ratio_means: How to read `ratio`.
    """

    name: str
    value: float
    unit: str
    baseline: str
    baseline_value: float
    ratio: float
    _: KW_ONLY
    ratio_means: str

    def as_dict(self) -> dict[str, Any]:
        """The row for JSON."""
        return asdict(self)


def seconds_per_call(work: Callable[[], object], calls: int) -> float:
    """Mean time of `calls` calls in a row [s]."""
    began = time.perf_counter()
    for _ in range(calls):
        work()
    return (time.perf_counter() - began) / calls


def processor_seconds(work: Callable[[], object], calls: int = 1) -> float:
    """Mean processor time of this process for each of `calls` calls in a row [s].

    Other programs do not count, but all threads do: it is for work of one thread.
    """
    began = time.process_time()
    for _ in range(calls):
        work()
    return (time.process_time() - began) / calls


def seconds_each(items: Sequence[Item], call: Callable[[Item], object]) -> float:
    """Mean time of a call over items [s]."""
    return seconds_per_call(lambda: [call(item) for item in items], 1) / len(items)


def real_time_row(name: str, sim_time: float, wall_times: Sequence[float]) -> TimingRow:
    """The best of some runs of a simulation, all of a simulated time [s]."""
    wall = min(wall_times)
    return TimingRow(
        name, wall, "s", "simulated time", sim_time, sim_time / wall, ratio_means="real-time factor"
    )


def interleaved(works: Sequence[Callable[[], float]], repeats: int) -> list[float]:
    """Medians of figures that several works return, taken in turns, so that all meet the same load.

    Args:
        works: Each returns one figure when called.
        repeats: How often each is called, after one call that does not count.
    """
    for work in works:
        work()
    figures = [[work() for work in works] for _ in range(repeats)]
    return [statistics.median(column) for column in zip(*figures, strict=True)]
