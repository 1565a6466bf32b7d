"""What scenarios of every kind share, sections `stop` and `integration`, and the engine's choice.

`StopSettings` and `IntegrationSettings` are the two sections of a visual servo. `set_engine`
chooses which engine moves the robot of a scenario that leaves the choice open.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass, replace
from typing import Any, TypeVar

from cdpr_drake.dynamics.explicit_kernel import METHODS
from cdpr_drake.schema.fields import file_name, number, optional_section, switch, text, whole
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.settings import AUTOMATIC, COMPILED, ENGINES, PLANT
from cdpr_drake.systems.worlds.settings import WorldSettings

DIAGRAM = "diagram"
LOOPS = (AUTOMATIC, DIAGRAM, COMPILED)
"""What steps a servo: a diagram, or `systems.loops.ServoLoop`."""

ENDINGS = tuple(
    outcome.name.lower() for outcome in Outcome
    if outcome not in (Outcome.RUNNING, Outcome.INTERRUPTED, Outcome.CLIENT_ENDED)
)  # fmt: skip
"""Outcomes that a file may expect: ends of a run, as `summary.json` names them."""


@dataclass(kw_only=True)
class ExpectedEnd:
    """Expected outcome of the unmodified scenario; the package's tests check it.

    The errors are true ones, at the end: the platform's from its desired pose; of `pick_and_place`
    the box's from its goal.
    """

    outcome: str = text("Outcome, as summary.json names it.", choices=ENDINGS)
    position: float | None = number(
        "Largest distance at the end; null: any, as of a run that is not to arrive.", "m", None,
        above=0.0,
    )  # fmt: skip
    rotation_deg: float | None = number(
        "Largest angle at the end; null: any.", "deg", None, above=0.0
    )


@dataclass(kw_only=True)
class RunHeader:
    """What a scenario is called, whatever it moves; all of them also have duration and expected."""

    kind: str = text("Kind of run.")
    name: str = file_name("Name, the same as that of its file.")
    title: str = text("What it shows, in one line.", "")
    source: str = text("Where its values stand.", "")


@dataclass(kw_only=True)
class ScenarioHeader(RunHeader):
    """What a scenario is called, which robot it moves, and how long it runs."""

    robot: str = text(
        "Robot by name, or path of a robot file, from this file or the working folder."
    )
    duration: float = number("Longest simulated time.", "s", above=0.0)
    seed: int = whole("Seed of noise and random directions.", 0, at_least=0)
    world: WorldSettings | None = optional_section(
        "What stands and moves round the robot; null: nothing but a floor to look at."
    )
    expected: ExpectedEnd | None = optional_section(
        "How a run of the file as it stands ends; null: nothing is expected. It changes no run."
    )


@dataclass(kw_only=True)
class StopSettings:
    """When the run ends before its duration is over."""

    position: float = number("Measured distance that counts as reached.", "m", above=0.0)
    rotation_deg: float = number("Measured angle that counts as reached.", "deg", above=0.0)
    hold: float = number("Time for which both must hold.", "s", 0.5, at_least=0.0)
    target_lost: float = number(
        "Time without the target after which the run ends.", "s", 2.0, above=0.0
    )
    broken_cable: bool = switch(
        "Whether the run ends when a cable passes the breaking load that the robot's file gives.",
        False,
    )
    contact: bool = switch(
        "Whether the run ends when the platform touches something of the world.", False
    )


@dataclass(kw_only=True)
class IntegrationSettings:
    """How the robot is integrated."""

    engine: str = text(
        "What moves the robot: Drake's MultibodyPlant, or compiled steps from event to event; "
        "automatic: the plant, but for repeated runs and those of more than ten minutes.",
        AUTOMATIC,
        choices=ENGINES,
    )
    loop: str = text(
        "What steps a servo: a Drake diagram, or one compiled loop without; automatic: the "
        "diagram, but for repeated runs that the loop can do.",
        AUTOMATIC,
        choices=LOOPS,
    )
    integrator: str = text(
        "Method, fixed step; semi_implicit, which no stiffness limits, by the engine compiled.",
        "runge_kutta3",
        choices=tuple(METHODS),
    )
    max_step: float | None = number(
        "Step; null: a share of the largest stable one, from the robot's vibrations, or 1 ms with "
        "semi_implicit.",
        "s",
        None,
        above=0.0,
    )
    accuracy: float | None = number(
        "Largest estimated error of one step, to which the engine compiled shortens it; null: any.",
        "m and rad",
        None,
        above=0.0,
    )


LONG_RUN = 600.0
"""Simulated time beyond which the compiled engine is chosen [s]."""

AnyScenario = TypeVar("AnyScenario")


def has_contact(scenario: Any) -> bool:
    """Whether the platform of a scenario of any kind touches its world."""
    return scenario.world is not None and scenario.world.contact is not None


def engine_of(scenario: Any) -> str:
    """The engine that moves the robot of a scenario of any kind: plant or compiled."""
    return COMPILED if scenario.integration.engine == COMPILED else PLANT


def many_steps_reason(scenario: Any, repeated: bool) -> str:
    """Why a scenario of any kind takes so many steps that its engine matters; empty: it does not.

    Args:
        scenario: The scenario.
        repeated: Whether it is one of many runs.
    """
    if repeated:
        return "the run is repeated"
    long = scenario.duration > LONG_RUN
    return f"it lasts longer than {LONG_RUN:g} s" if long else ""


def set_engine(scenario: AnyScenario, repeated: bool = False) -> tuple[AnyScenario, str]:
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
    if getattr(asked, "plant_alone", False):
        return scenario, ""
    why = many_steps_reason(asked, repeated)
    if asked.integration.engine != AUTOMATIC or not why:
        return scenario, ""
    integration = replace(asked.integration, engine=COMPILED)
    other = "with overrides integration.engine=plant"
    words = f"{asked.name}: by the compiled engine, as {why}; else {other}"
    return replace(asked, integration=integration), words
