"""A process outside in the loop of a run."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.remote import Remote

Connect = Callable[[Remote], None]
"""Brings a process to its place: sets the `commander` of a `Remote`."""


def check_connected(scenario: Any, connect: Connect | None) -> None:
    """Refuses a run whose loop nobody closes, or that has no place for who should.

    Raises:
        ScenarioError: See above.
    """
    if scenario.remote is not None and connect is None:
        raise ScenarioError(
            f"{scenario.name}: remote: found a section, so a process outside closes the loop; "
            "accepted: cdpr serve, or remote: null"
        )
    if scenario.remote is None and connect is not None:
        raise ScenarioError(
            f"{scenario.name}: remote: found null; accepted: a section with a place"
        )


def resting(remote: Remote | None) -> AbstractContextManager[None]:
    """Nobody is asked inside the block."""
    return nullcontext() if remote is None else remote.resting()
