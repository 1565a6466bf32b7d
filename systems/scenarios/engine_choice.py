"""Which engine moves the robot of a scenario that leaves the choice open."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

from cdpr_drake.systems.robots import AUTOMATIC, COMPILED, PLANT

LONG_RUN = 600.0
"""Simulated time beyond which the compiled engine is chosen [s]."""

AnyScenario = TypeVar("AnyScenario")


def has_contact(scenario: Any) -> bool:
    """Whether the platform of a scenario of any kind touches its world."""
    return scenario.world is not None and scenario.world.contact is not None


def engine_of(scenario: Any) -> str:
    """The engine that moves the robot of a scenario of any kind: plant or compiled."""
    return COMPILED if scenario.integration.engine == COMPILED else PLANT


def why_many_steps(scenario: Any, repeated: bool) -> str:
    """Why a scenario of any kind takes so many steps that its engine matters; empty: it does not.

    Args:
        scenario: The scenario.
        repeated: Whether it is one of many runs.
    """
    if repeated:
        return "the run is repeated"
    long = scenario.duration > LONG_RUN
    return f"it lasts longer than {LONG_RUN:g} s" if long else ""


def with_engine(scenario: AnyScenario, repeated: bool = False) -> tuple[AnyScenario, str]:
    """A scenario of which the engine is chosen, and a line that says so; empty for the plant.

    Both engines come to the same ends (`cdpr study engines`), the compiled one sooner. An engine
    that the scenario asks for is left as it is.

    Args:
        scenario: A scenario of any kind.
        repeated: Whether it is one of many runs.
    """
    asked: Any = scenario
    if asked.integration.engine == AUTOMATIC and has_contact(scenario):
        why = "its world has contact, which the compiled engine has not"
        return scenario, f"{asked.name}: by the engine plant, as {why}"
    why = why_many_steps(asked, repeated)
    if asked.integration.engine != AUTOMATIC or not why:
        return scenario, ""
    integration = replace(asked.integration, engine=COMPILED)
    words = f"{asked.name}: by the compiled engine, as {why}; else --set integration.engine=plant"
    return replace(asked, integration=integration), words
