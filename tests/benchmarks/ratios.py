"""What benchmarks share: ways to compute, timed in turns, and their ratios."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from cdpr_drake.analyses.reporting.timing import interleaved, processor_seconds

PREFIXES = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"))


@dataclass(frozen=True)
class Ratio:
    """A way to compute against another in the same run.

    Attributes:
        name: The way.
        seconds: Its time, the median over repeats [s].
        baseline: What it is compared with.
        baseline_seconds: The baseline's time [s].
    """

    name: str
    seconds: float
    baseline: str
    baseline_seconds: float

    @property
    def faster(self) -> float:
        """How many times as fast it is as the baseline."""
        return self.baseline_seconds / self.seconds

    def __str__(self) -> str:
        """A line of a table; a way that is slower is so many times as long."""
        faster = self.faster
        words = (
            f"{faster:.3g} times as fast" if faster >= 1.0 else f"{1 / faster:.3g} times as long"
        )
        return (
            f"{self.name:54} {_time(self.seconds):>8}   {words} as {self.baseline} "
            f"({_time(self.baseline_seconds)})"
        )


def _time(seconds: float) -> str:
    """Three digits with a unit."""
    size, unit = next((p for p in PREFIXES if seconds >= p[0]), PREFIXES[-1])
    return f"{seconds / size:.3g} {unit}"


def ratios(ways: dict[str, Callable[[], float]], repeats: int = 9) -> list[Ratio]:
    """Medians of ways that return times [s], taken in turns; each against the last of them."""
    *seconds, base = interleaved(list(ways.values()), repeats)
    *names, baseline = ways
    return [Ratio(name, value, baseline, base) for name, value in zip(names, seconds, strict=True)]


def per_call(work: Callable[[], object], calls: int = 1, parts: int = 1) -> Callable[[], float]:
    """A way: mean processor time of so many calls, or of one of the parts of a call [s]."""
    return lambda: processor_seconds(work, calls) / parts


def per_item(items: Sequence[Any], call: Callable[..., object]) -> Callable[[], float]:
    """A way: mean processor time of a call on each item [s]."""
    return per_call(lambda: [call(item) for item in items], parts=len(items))
