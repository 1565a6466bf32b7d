"""Timings as ratios within one run, since absolute times say little on another machine."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import TypeVar

Item = TypeVar("Item")


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
