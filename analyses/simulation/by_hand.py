"""What is done to a robot by hand while it runs: a cable that breaks, a push at the platform.

Both are entered into the sections `failures` and `disturbances` of the scenario, with their times,
so that the results hold what was done, and the scenario among them gives the same run again. A run
takes them where its scenario has these sections: `UNTOUCHED` has nothing that happens by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import floor
from typing import Any

import numpy as np
from pydrake.systems.framework import Diagram, System

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.robots.disturbances import PUSH as PUSHED
from cdpr_drake.systems.robots.disturbances import Disturbances, Push
from cdpr_drake.systems.robots.failures import BREAKS, Failure, Failures

BREAK, PUSH = "break", "push"

UNTOUCHED = {
    BREAK: ("failures", "{events: []}"),
    PUSH: ("disturbances", "{pushes: [{kind: step, force: [0.0, 0.0, 0.0]}]}"),
}
"""Section of a scenario, and the least that it may have, by what can then be done by hand."""

LARGEST_FORCE = 1e6
"""Of a push [N]."""

LONGEST_PUSH = 60.0
"""Of a push [s]."""


class ByHand:
    """Does to a running diagram what somebody asks for.

    Attributes:
        takes: What can be done: `BREAK`, `PUSH`, both or none.
    """

    def __init__(self, scenario: Any) -> None:
        """For the scenario that the diagram was, or will be, made of."""
        failures, disturbances = (
            getattr(scenario, section, None) for section, _ in UNTOUCHED.values()
        )
        # With events from the start their times are fixed in the diagram.
        may_break = failures is not None and not failures.events
        self.takes = tuple(
            name for name, can in ((BREAK, may_break), (PUSH, disturbances is not None)) if can
        )
        self._cables = [cable.name for cable in load_robot(scenario.robot).cables]
        self._broken: set[int] = set()
        self._failures: Failures | None = None
        self._disturbances: Disturbances | None = None

    def find(self, diagram: Diagram) -> None:
        """Finds the blocks that do it."""
        for system in _blocks(diagram):
            if isinstance(system, Failures):
                self._failures = system
            elif isinstance(system, Disturbances):
                self._disturbances = system

    def do(self, asked: Mapping[str, Any], now: float) -> dict[str, Any]:
        """Does it at the next step, and says so: time and words.

        Args:
            asked: `what` and what belongs to it, see `live_messages`.
            now: The simulated time [s].

        Raises:
            ScenarioError: It cannot be done; one line.
        """
        what = asked["what"]
        if what not in self.takes:
            raise ScenarioError(
                f"{what}: found it with a scenario without {UNTOUCHED[what][0]}; accepted: "
                f"{', '.join(self.takes) or 'nothing by hand'}"
            )
        return self._break(asked, now) if what == BREAK else self._push(asked, now)

    def _break(self, asked: Mapping[str, Any], now: float) -> dict[str, Any]:
        assert self._failures is not None
        number, count = asked.get("cable"), len(self._cables)
        if not isinstance(number, int) or not 0 <= number < count or number in self._broken:
            left = [str(k) for k in range(count) if k not in self._broken]
            raise ScenarioError(f"cable: found {number}; accepted: {', '.join(left)}")
        self._broken.add(number)
        self._failures.add(Failure(kind=BREAKS, time=now, cable=number))
        return {"t": now, "words": f"{self._cables[number]} breaks", "cable": number}

    def _push(self, asked: Mapping[str, Any], now: float) -> dict[str, Any]:
        assert self._disturbances is not None
        try:
            force = np.array(asked.get("force"), float)
            seconds = float(asked.get("seconds", np.nan))
        except (TypeError, ValueError):
            force, seconds = np.full(3, np.nan), np.nan
        size = float(np.linalg.norm(force)) if force.shape == (3,) else np.nan
        if not 0.0 < size <= LARGEST_FORCE:
            raise ScenarioError(
                f"force: found {str(asked.get('force'))[:60]}; accepted: three numbers, together "
                f"above 0 to {LARGEST_FORCE:g} N"
            )
        if not 0.0 < seconds <= LONGEST_PUSH:
            raise ScenarioError(
                f"seconds: found {str(asked.get('seconds'))[:60]}; accepted: above 0 to "
                f"{LONGEST_PUSH:g} s"
            )
        period = self._disturbances.period
        start = (floor(now / period) + 1) * period  # what is under way is not changed
        self._disturbances.add(Push(kind=PUSHED, start=start, end=start + seconds, force=force))
        return {"t": now, "words": f"push of {size:g} N for {seconds:g} s"}


def _blocks(diagram: Diagram) -> Iterator[System]:
    for system in diagram.GetSystems():
        yield system
        if isinstance(system, Diagram):
            yield from _blocks(system)
