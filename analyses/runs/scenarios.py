"""Scenarios as verbs take them: by name, file or folder, with settings of their own."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias, TypeVar, overload

from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.diagrams.load import load_scenario as load_any_scenario
from cdpr_drake.systems.scenarios.files import MECHANISM, TENSION_CONTROL, scenario_kind
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
    return load_any_scenario(name, overrides, schema=schema)


def scenario_with(
    scenario: Any, overrides: Sequence[str] = (), *, camera: str | None = None,
    duration: float | None = None, seed: int | None = None, log_rate: float | None = None,
) -> Any:  # fmt: skip
    """A scenario by name, file or folder, with the settings that have arguments of their own.

    Raises:
        ScenarioError: It is unknown, malformed, a robot, or loaded already and there are settings.
    """
    settings = {"camera.kind": camera, "duration": duration, "seed": seed, "log_rate": log_rate}
    items = [f"{key}={value}" for key, value in settings.items() if value is not None]
    if isinstance(scenario, Robot | Mechanism):
        raise ScenarioError(
            f"scenario: found the robot {scenario.name}; accepted: a scenario, which names a "
            "robot; solve_tensions, compute_workspace, assess_stability and view take robots"
        )
    if not isinstance(scenario, str | Path):
        if items or overrides:
            raise ScenarioError("scenario: found a loaded one with overrides; accepted: its name")
        return scenario
    name = str(scenario)
    if camera is not None and scenario_kind(name) in (TENSION_CONTROL, MECHANISM):
        raise ScenarioError(f"camera: found with {name}, which has no camera; accepted: without")
    return load_any_scenario(name, [*overrides, *items])
