"""Which scenarios a loop can do without a diagram, and which of them it does."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.cameras.camera_settings import PROJECTED
from cdpr_drake.systems.controllers.tension_management_settings import IMAGE
from cdpr_drake.systems.diagrams.servo_models import servo_model
from cdpr_drake.systems.loops.basis import loop_basis
from cdpr_drake.systems.loops.parts import checked_estimator, checked_sensor
from cdpr_drake.systems.robots.settings import AUTOMATIC, COMPILED, PLANT
from cdpr_drake.systems.scenarios.run_settings import (
    DIAGRAM,
    AnyScenario,
    has_contact,
    many_steps_reason,
    set_engine,
)
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sections import sections_of
from cdpr_drake.systems.sensors.sensor_kinds import SENSORS


def diagram_reason(scenario: Any) -> str:
    """Why only a diagram can do a scenario, in one phrase; empty where a loop can.

    Args:
        scenario: A scenario of any kind, checked.
    """
    reason = _no_loop_reason(scenario)
    if reason:
        return reason
    robot = load_robot(scenario.robot)
    task = servo_model(scenario, robot).estimator_task(scenario)
    try:
        for kind in (scenario.estimator.kind, *scenario.estimator.compare):
            checked_estimator(kind, task)
        for name in SENSORS:
            checked_sensor(name, scenario, robot)
    except ScenarioError as problem:
        return str(problem)
    return ""


def _no_loop_reason(scenario: Any) -> str:
    """As `diagram_reason`, as far as settings and robot tell."""
    if not isinstance(scenario, Scenario):
        return "it is no visual servo"
    if has_contact(scenario):
        return "its world has contact"
    if scenario.world is not None:
        return "the clearances of its world are measured by blocks"
    if scenario.failures is not None:
        return "its failures are a block of a diagram"
    if scenario.integration.engine == PLANT:
        return "its engine is the plant"
    if scenario.camera.kind != PROJECTED:
        return f"its camera is {scenario.camera.kind}"
    if scenario.estimator.platform_tag is not None:
        return "a second camera looks at the platform"
    if scenario.tension_management is not None and scenario.tension_management.kind == IMAGE:
        return "a camera looks at the cables"
    if scenario.winches.mode != "velocity":
        return f"its winches are commanded by {scenario.winches.mode}"
    for key, _ in sections_of(scenario):
        return f"its section {key} adds blocks to a diagram"
    robot = loop_basis(scenario).robot
    if robot.knows_breaking_loads():
        return f"the cables of {robot.name} are watched for breaking"
    if robot.winch_groups().are_shared():
        return f"{robot.name} has several cables on one winch"
    if scenario.winches.has_motors() and robot.winch_law().brake_torque > 0.0:
        return f"the winches of {robot.name} have brakes"
    return ""


def uses_compiled_loop(scenario: Any) -> bool:
    """Whether a loop does a scenario: one asked for, or chosen by `set_loop`."""
    return isinstance(scenario, Scenario) and scenario.integration.loop == COMPILED


def check_loop(scenario: Scenario) -> Scenario:
    """The scenario as a loop does it, by the compiled engine.

    Raises:
        ScenarioError: Only a diagram can.
    """
    reason = _no_loop_reason(scenario)
    if reason:
        raise ScenarioError(
            f"{scenario.name}: integration.loop: found compiled, but {reason}; accepted: diagram "
            "or automatic"
        )
    return replace(scenario, integration=replace(scenario.integration, engine=COMPILED))


def choose_compiled_loop(scenario: Scenario) -> Scenario:
    """The scenario by the loop where that is possible and nothing else was asked for, else as it
    was; for studies, which run it many times."""
    integration = scenario.integration
    if integration.loop != AUTOMATIC or integration.engine == PLANT or diagram_reason(scenario):
        return scenario
    return replace(scenario, integration=replace(integration, engine=COMPILED, loop=COMPILED))


def set_loop(
    scenario: AnyScenario, repeated: bool = False, watched: bool = False
) -> tuple[AnyScenario, str]:
    """A scenario of which engine and loop are chosen, and a line that says so; empty: the plant.

    What the scenario asks for is left as it is. Long runs and repeated ones take the loop.

    Args:
        scenario: A scenario of any kind.
        repeated: Whether it is one of many runs.
        watched: Whether Meshcat or the studio shows it, which look into a diagram.

    Raises:
        ScenarioError: It asks for the loop, which cannot do it.
    """
    asked: Any = scenario
    if not isinstance(asked, Scenario):
        return set_engine(scenario, repeated)
    if uses_compiled_loop(asked):
        checked = check_loop(asked)
        return checked, f"{asked.name}: by the compiled loop"  # type: ignore[return-value]
    chosen, words = set_engine(asked, repeated)
    why = many_steps_reason(asked, repeated)
    if not why or chosen.integration.engine != COMPILED or asked.integration.loop == DIAGRAM:
        return chosen, words  # type: ignore[return-value]
    reason = "a viewer looks into one" if watched else diagram_reason(chosen)
    if reason:
        return chosen, f"{words or asked.name}; in a diagram, as {reason}"  # type: ignore[return-value]
    other = "with overrides integration.loop=diagram"
    made = replace(chosen, integration=replace(chosen.integration, loop=COMPILED))
    words = f"{asked.name}: by the compiled loop, as {why}; else {other}"
    return made, words  # type: ignore[return-value]
