"""Where long work stands."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class WorkProgress:
    """Where long work stands.

    Attributes:
        what: What it is doing, or has finished last, in a few words.
        done: Work done, in simulated time [s] or in what `rate` counts.
        total: All work, the same.
        wall_time: Time since this session began [s].
        rate: Words for the work done per second.
        found: Of the work done, what earlier sessions left in the folder.
        items: Words for what is counted.
    """

    what: str
    done: float
    total: float
    wall_time: float
    rate: str = field(default="x real time", kw_only=True)
    found: float = field(default=0, kw_only=True)
    items: str = field(default="s", kw_only=True)

    @property
    def speed(self) -> float:
        """Work done per second in this session."""
        return (self.done - self.found) / max(self.wall_time, 1e-9)

    def counts(self, done: str = "done") -> dict[str, float]:
        """How much is done, of how much, and how much of it was there, for JSON; `done` names the
        first."""
        return {done: self.done, "of": self.total, "by_earlier_sessions": self.found}
