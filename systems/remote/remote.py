"""The place of a process outside: whom it asks, and what stands there until then."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.bridge import Port
from cdpr_drake.errors import ClientEndedError

Read = Callable[[str], Array]
"""What stands at an output, by its name."""


class Commander(Protocol):
    """Who gives commands; `bridge.Driver` does."""

    def exchange(self, now: float, read: Read) -> Mapping[str, Array]:
        """Commands at a time [s], by the names of the inputs."""

    def report(self) -> dict[str, Any]:
        """What was exchanged, for a summary."""


class Remote:
    """Asks whoever commands for what a block would decide.

    A run sets `commander` before it starts; without one, asking raises.
    """

    def __init__(
        self,
        place: str,
        inputs: Sequence[Port],
        outputs: Sequence[Port],
        resting: Mapping[str, Array],
    ) -> None:
        """A place without anybody.

        Args:
            place: Name of the place.
            inputs: What is commanded.
            outputs: What can be seen.
            resting: Commands while kernels are loaded, by the names of the inputs.
        """
        self.place, self.inputs, self.outputs = place, tuple(inputs), tuple(outputs)
        self.commander: Commander | None = None
        self._resting = {name: np.array(value, float) for name, value in resting.items()}
        self._rests = False

    @contextmanager
    def resting(self) -> Iterator[None]:
        """Nobody is asked inside the block; the platform rests."""
        self._rests = True
        try:
            yield
        finally:
            self._rests = False

    def ask(self, now: float, read: Read) -> Mapping[str, Array]:
        """Commands at a time [s], by the names of the inputs; `read` says what stands at outputs.

        Raises:
            ClientEndedError: Nobody is there, or not any more.
        """
        if self._rests:
            return self._resting
        if self.commander is None:
            raise ClientEndedError(f"nobody stands in the place {self.place}; see cdpr serve")
        return self.commander.exchange(now, read)

    def report(self) -> dict[str, Any]:
        """Place and what was exchanged, for a summary."""
        found = {} if self.commander is None else self.commander.report()
        return {"place": self.place, **found}
