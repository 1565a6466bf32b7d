"""What scenarios of every kind share, and the sections `stop` and `integration` of a servo's.

Drake's YAML loader reads the annotations themselves, so they are not postponed here.
"""

from dataclasses import dataclass

from cdpr_drake.dynamics import METHODS
from cdpr_drake.schema import file_name, number, optional_section, switch, text, whole
from cdpr_drake.systems.monitoring import Outcome
from cdpr_drake.systems.robots import AUTOMATIC, COMPILED, ENGINES
from cdpr_drake.systems.worlds import WorldSettings

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
    """How a run of the file as it stands ends; `cdpr study scenarios` holds it against this.

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
class ScenarioHeader:
    """What a scenario is called, which robot it moves, and how long it runs."""

    kind: str = text("Kind of run.")
    name: str = file_name("Name, the same as that of its file.")
    title: str = text("What it shows, in one line.", "")
    source: str = text("Where its values stand.", "")
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
