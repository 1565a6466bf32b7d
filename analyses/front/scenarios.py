"""Scenarios as users load them, with the types of what their files describe."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, overload

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.systems.diagrams.load import load_scenario as load_any_scenario
from cdpr_drake.systems.scenarios.mechanism_scenario import MechanismScenario
from cdpr_drake.systems.scenarios.pick_and_place_scenario import PickAndPlaceScenario
from cdpr_drake.systems.scenarios.run_settings import RunHeader
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

AnyScenario: TypeAlias = Scenario | TensionScenario | PickAndPlaceScenario | MechanismScenario
"""What the key `kind` of a file chooses from."""

S = TypeVar("S", bound=RunHeader)


@overload
def load_scenario(name: str | Path, overrides: Sequence[str] = (), *, schema: type[S]) -> S: ...


@overload
def load_scenario(name: str | Path, overrides: Sequence[str] = ()) -> AnyScenario: ...


@verb()
def load_scenario(
    name: str | Path, overrides: Sequence[str] = (), *, schema: type[Any] | None = None
) -> Any:
    """Reads a scenario, and checks it against its robot or mechanism.

    Args:
        name: A name of `scenario_names()`, the path of a YAML file, or the folder of a run.
        overrides: Items "key.subkey=value" that replace what the file says.
        schema: Class that it is read into: that of its kind, as `Scenario` of visual servos, or a
            subclass with more sections; None: that of the kind that its file gives.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its robot cannot do what it asks.
        RobotFileError: Its robot's file does not describe a possible robot.
    """
    return load_any_scenario(str(name), overrides, schema=schema)
