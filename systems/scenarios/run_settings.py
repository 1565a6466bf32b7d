"""What scenarios of every kind share, sections `stop` and `integration`, and the engine's choice.

`StopSettings` and `IntegrationSettings` are the two sections of a visual servo. `set_engine`
chooses which engine moves the robot of a scenario that leaves the choice open.
"""

from dataclasses import replace
from typing import Annotated, Any, TypeVar

from cdpr_drake.dynamics.explicit_kernel import METHODS
from cdpr_drake.schema.declarations import In, Name, OneOf, Switch, Text, settings
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.robots.settings import AUTOMATIC, COMPILED, ENGINES, PLANT
from cdpr_drake.systems.sections import sections_of, with_sections
from cdpr_drake.systems.worlds.settings import WorldSettings

DIAGRAM = "diagram"
LOOPS = (AUTOMATIC, DIAGRAM, COMPILED)
"""What steps a servo: a diagram, or `systems.loops.ServoLoop`."""

ENDINGS = tuple(
    outcome.name.lower() for outcome in Outcome
    if outcome not in (Outcome.RUNNING, Outcome.INTERRUPTED, Outcome.CLIENT_ENDED)
)  # fmt: skip
"""Outcomes that a file may expect: ends of a run, as `summary.json` names them."""


@settings
class ExpectedEnd:
    """Expected outcome of the unmodified scenario; the package's tests check it.

    The errors are true ones, at the end: the platform's from its desired pose; of `pick_and_place`
    the box's from its goal.
    """

    outcome: Annotated[str, OneOf(ENDINGS), "Outcome, as summary.json names it."]
    position: Annotated[
        float | None,
        In("m", gt=0.0),
        "Largest distance at the end; null: any, as of a run that is not to arrive.",
    ] = None
    rotation_deg: Annotated[
        float | None, In("deg", gt=0.0), "Largest angle at the end; null: any."
    ] = None


@settings
class RunHeader:
    """What a scenario is called, whatever it moves; all of them also have duration and expected."""

    kind: Annotated[Text, "Kind of run."]
    name: Annotated[Name, "Name, the same as that of its file."]
    title: Annotated[Text, "What it shows, in one line."] = ""
    source: Annotated[Text, "Where its values stand."] = ""


@settings
@with_sections("robot_scenario")
class ScenarioHeader(RunHeader):
    """What a scenario is called, which robot it moves, and how long it runs."""

    robot: Annotated[
        Text, "Robot by name, or path of a robot file, from this file or the working folder."
    ]
    duration: Annotated[float, In("s", gt=0.0), "Longest simulated time."]
    seed: Annotated[int, In(ge=0), "Seed of noise and random directions."] = 0
    world: Annotated[
        WorldSettings | None,
        "What stands and moves round the robot; null: nothing but a floor to look at.",
    ] = None
    expected: Annotated[
        ExpectedEnd | None,
        "How a run of the file as it stands ends; null: nothing is expected. It changes no run.",
    ] = None


@settings
class StopSettings:
    """When the run ends before its duration is over."""

    position: Annotated[float, In("m", gt=0.0), "Measured distance that counts as reached."]
    rotation_deg: Annotated[float, In("deg", gt=0.0), "Measured angle that counts as reached."]
    hold: Annotated[float, In("s", ge=0.0), "Time for which both must hold."] = 0.5
    target_lost: Annotated[
        float, In("s", gt=0.0), "Time without the target after which the run ends."
    ] = 2.0
    broken_cable: Annotated[
        Switch,
        "Whether the run ends when a cable passes the breaking load that the robot's file gives.",
    ] = False
    contact: Annotated[
        Switch, "Whether the run ends when the platform touches something of the world."
    ] = False


@settings
class IntegrationSettings:
    """How the robot is integrated."""

    engine: Annotated[
        str,
        OneOf(ENGINES),
        "What moves the robot: Drake's MultibodyPlant, or compiled steps from event to "
        "event; automatic: the plant, but for repeated runs and those of more than ten "
        "minutes.",
    ] = AUTOMATIC
    loop: Annotated[
        str,
        OneOf(LOOPS),
        "What steps a servo: a Drake diagram, or one compiled loop without; automatic: "
        "the diagram, but for repeated runs that the loop can do.",
    ] = AUTOMATIC
    integrator: Annotated[
        str,
        OneOf(METHODS),
        "Method, fixed step; semi_implicit, which no stiffness limits, by the engine compiled.",
    ] = "runge_kutta3"
    max_step: Annotated[
        float | None,
        In("s", gt=0.0),
        "Step; null: a share of the largest stable one, from the robot's vibrations, or 1"
        " ms with semi_implicit.",
    ] = None
    accuracy: Annotated[
        float | None,
        In("m and rad", gt=0.0),
        "Largest estimated error of one step, to which the engine compiled shortens it; null: any.",
    ] = None


LONG_RUN = 600.0
"""Simulated time beyond which the compiled engine is chosen [s]."""

AnyScenario = TypeVar("AnyScenario")


def has_contact(scenario: Any) -> bool:
    """Whether the platform of a scenario of any kind touches its world."""
    return scenario.world is not None and scenario.world.contact is not None


def engine_of(scenario: Any) -> str:
    """The engine that moves the robot of a scenario of any kind: plant or compiled."""
    return COMPILED if scenario.integration.engine == COMPILED else PLANT


def needs_plant(scenario: Any) -> bool:
    """Whether the engine plant alone can run a scenario of any kind, contact aside."""
    return any(section.needs_plant(scenario) for _, section in sections_of(scenario))


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
    if needs_plant(asked):
        return scenario, ""
    why = many_steps_reason(asked, repeated)
    if asked.integration.engine != AUTOMATIC or not why:
        return scenario, ""
    integration = replace(asked.integration, engine=COMPILED)
    other = "with overrides integration.engine=plant"
    words = f"{asked.name}: by the compiled engine, as {why}; else {other}"
    return replace(asked, integration=integration), words
