"""Loads scenarios of any kind and checks them against their robots; a new kind is one entry of
`SCENARIO_SCHEMAS`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.control.force_balance import FORCE, force_problem
from cdpr_drake.errors import (
    CableGeometryError,
    RobotFileError,
    ScenarioError,
    TensionProblemError,
    TrajectoryError,
)
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_holding import check_pulleys
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import check_pose, tension_problem
from cdpr_drake.schema.declarations import Refusal, Scope, told
from cdpr_drake.schema.typed_yaml import load_typed, parse_typed
from cdpr_drake.systems.diagrams.mechanism_control import (
    mechanism_refusals,
)
from cdpr_drake.systems.diagrams.scenario_checks import SERVO_REFUSALS
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.scenarios.files import (
    MECHANISM,
    PICK_AND_PLACE,
    TENSION_CONTROL,
    VISUAL_SERVO,
    belief_refusals,
    mechanism_scope,
    robot_scope,
    scenario_file,
    scenario_kind,
    unknown_robot,
)
from cdpr_drake.systems.scenarios.mechanism_scenario import MechanismScenario
from cdpr_drake.systems.scenarios.pick_and_place_scenario import (
    PickAndPlaceScenario,
    pick_and_place_refusals,
)
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sections import sections_of
from cdpr_drake.systems.worlds.checks import world_refusals
from cdpr_drake.systems.worlds.world import make_world
from cdpr_drake.tensions.methods import distribute
from cdpr_drake.tensions.shortfall import shortfall

FILE_LOOKS = 101
"""Instants at which the poses of a motion from a file are looked at."""


def read_inputs(scenario: Scenario) -> None:
    """Reads the files of users that a visual servo's run reads, so that `inputs_read_once` has
    them: robot and believed robot, cameras, and the obstacles' meshes and models.

    Raises:
        CdprError: One cannot be read.
    """
    robot = load_robot(scenario.robot)
    believed, asked = scenario.perturbations.believed_robot, scenario.camera
    robots = [robot] if believed is None else [robot, load_robot(believed)]
    models = {mount.model for each in robots for mount in each.cameras}
    named = (asked.model, scenario.perturbations.camera_model)
    for model in sorted(models.union(name for name in named if name is not None)):
        load_camera(model)
    if scenario.world is not None:
        make_world(scenario.world, robot)


def _control_refusals(scope: Scope) -> Iterator[Refusal]:
    """Robots that dynamic control is not for."""
    robot = scope.robot
    if robot.winch_groups().are_shared():
        found = f"{robot.name} with several cables on one winch, which cannot be given tensions"
        yield "robot", f"{found} one by one", "a robot with a winch for each cable"


def _engine_refusals(scope: Scope) -> Iterator[Refusal]:
    """Sections beside the engine compiled that the plant alone can run."""
    scenario = scope.whole
    for key, section in sections_of(scenario):
        if section.needs_plant(scenario) and scenario.integration.engine == COMPILED:
            yield "integration.engine", f"{COMPILED} beside {key}", "plant"


def _tension_refusals(scope: Scope) -> Iterator[Refusal]:
    """What a scenario of dynamic control is refused for beside what its sections say."""
    scenario, robot = scope.whole, scope.robot
    wrong = [*_control_refusals(scope), *_motion_refusals(scope)]
    yield from wrong
    if wrong:
        return
    poses = _poses_of(scenario)
    yield from world_refusals(
        scenario.world, robot, next(iter(poses.values())),
        compiled=scenario.integration.engine == COMPILED, stop=scenario.stop.contact,
    )  # fmt: skip
    said = set[str]()
    for key, X_WP in poses.items():
        words = _why_not_held(X_WP, scenario, robot)
        if words and words not in said:  # settings that are wrong are wrong for every pose
            said.add(words)
            yield key, words, ""


def _motion_refusals(scope: Scope) -> Iterator[Refusal]:
    """A trajectory that is none, or leads where the platform cannot be.

    Between its ends a motion from a file may pass poses that nothing holds; there the platform
    must only be where it can.
    """
    scenario, settings = scope.whole, scope.whole.trajectory
    if settings.file is None:
        if settings.start is None:
            yield "trajectory.start", "none", "a pose, or trajectory.file"
        if not settings.stretches:
            yield "trajectory.stretches", "none", "at least one"
        return
    try:
        motion = settings.trajectory()
    except TrajectoryError as problem:
        yield told(problem, "trajectory.file")
        return
    for t in np.linspace(motion.start_time, motion.end_time, FILE_LOOKS):
        try:
            check_pose(scope.robot, motion.pose(float(t)))
        except TensionProblemError as problem:
            found = f"{settings.file}: at {t:.4g} s: {problem}"
            yield "trajectory.file", found, "poses that the platform can have"
            return
    if scenario.duration <= motion.start_time:
        begins = f"{motion.start_time:g} s, when the motion of trajectory.file begins"
        yield "duration", f"{scenario.duration:g} s", f"longer than {begins}"


def _poses_of(scenario: TensionScenario) -> dict[str, RigidTransform]:
    """Where the platform rests along a trajectory, by key, at time 0 first [m]."""
    settings = scenario.trajectory
    if settings.file is not None:
        motion = settings.trajectory()
        return {"trajectory.file": motion.poses[0], "trajectory": motion.poses[-1]}
    assert settings.start is not None
    poses = {"trajectory.start": settings.start.transform()}
    for k, stretch in enumerate(settings.stretches):
        poses[f"trajectory.stretches[{k}].pose"] = stretch.pose.transform()
    return poses


def _why_not_held(X_WP: RigidTransform, scenario: TensionScenario, robot: Robot) -> str:
    """Why no tensions hold a pose of a trajectory; empty where some do."""
    cables = scenario.cable_set(robot)
    try:
        if scenario.cables.pulleys:
            check_pulleys(robot, X_WP, cables)
        problem_there = tension_problem(
            robot,
            X_WP,
            limits=scenario.limits(),
            reference=scenario.reference_tensions(robot),
            cables=cables,
        )
        if scenario.controller.balance == FORCE:
            problem_there = force_problem(problem_there, robot.motion_type().num_turns)
        solution = distribute(problem_there, "quadratic_program")
        distribute(problem_there, scenario.distribution.method)
    except (CableGeometryError, TensionProblemError) as problem:
        return str(problem)
    if solution.status == "feasible":
        return ""
    low, high = problem_there.lower[0], problem_there.upper[0]
    return (
        f"found {X_WP.translation().tolist()} m, where no tensions within {low:g}..{high:g} N hold "
        f"the platform, bounds missed by {shortfall(problem_there).beyond:.3g} N; accepted: a pose "
        "that can be held"
    )


def check_robot_motion(robot: Robot, where: Path | str) -> None:
    """Refuses robots that neither servos nor computed torque know.

    Args:
        robot: The robot.
        where: The scenario, for the message.

    Raises:
        ScenarioError: Names the robot and its degrees of freedom.
    """
    try:
        rows = robot.servo_rows("scenarios")
    except RobotFileError as problem:
        raise ScenarioError(f"{where}: {problem}") from problem
    if len(robot.cables) < len(rows):
        raise ScenarioError(
            f"{where}: robot: found {robot.name} with {len(robot.cables)} cables for {len(rows)} "
            f"degrees of freedom; accepted in scenarios: at least {len(rows)} cables, "
            "since with fewer no tensions control the whole pose"
        )


SCENARIO_SCHEMAS: dict[str, tuple[type[Any], tuple[Callable[[Scope], Iterator[Refusal]], ...]]] = {
    VISUAL_SERVO: (Scenario, (belief_refusals, _engine_refusals, *SERVO_REFUSALS)),
    TENSION_CONTROL: (TensionScenario, (belief_refusals, _engine_refusals, _tension_refusals)),
    PICK_AND_PLACE: (PickAndPlaceScenario, (pick_and_place_refusals,)),
    MECHANISM: (MechanismScenario, (mechanism_refusals,)),
}
"""Schema of each kind of scenario, and what it is refused for beside its sections, with its robot
or mechanism, by what its file gives as `kind`."""


def load_scenario(
    name: str | Path, overrides: Sequence[str] = (), *, schema: type[Any] | None = None
) -> Any:
    """Reads a scenario, and checks it against its robot or mechanism.

    Args:
        name: A name of `scenario_names()`, the path of a YAML file, or the folder of a run.
        overrides: Items "key.subkey=value" that replace what the file says.
        schema: Class that it is read into: a subclass, with more sections, of its kind's; None:
            its kind's.

    Returns:
        A `Scenario`, `TensionScenario`, `PickAndPlaceScenario` or `MechanismScenario`, as the
        file's key `kind` says.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its robot cannot do what it asks.
        RobotFileError: Its robot's file does not describe a possible robot.
    """
    name = str(name)
    kind = scenario_kind(name)
    path, (of_kind, _) = scenario_file(name), SCENARIO_SCHEMAS[kind]
    if schema is not None and not issubclass(schema, of_kind):
        raise ScenarioError(
            f"{path}: kind: found {kind}, not described by {schema.__name__}; "
            f"accepted: {of_kind.__name__}, or a subclass of it with more sections"
        )
    try:
        return load_typed(
            schema or of_kind, path, error=ScenarioError, overrides=overrides,
            scope=_scope_of(kind, path),
        )  # fmt: skip
    except ScenarioError as problem:
        if kind == MECHANISM:
            raise
        raise ScenarioError(*problem.problems, *unknown_robot(path, overrides)) from problem


def parse_scenario(content: str, path: Path, overrides: Sequence[str] = ()) -> Any:
    """As `load_scenario`, from another text of a scenario's file, of the same kind.

    Args:
        content: YAML.
        path: The file, which messages name.
        overrides: As for `load_scenario`.

    Raises:
        ScenarioError: As `load_scenario`.
        RobotFileError: As `load_scenario`.
    """
    kind = scenario_kind(str(path))
    schema, scope = SCENARIO_SCHEMAS[kind][0], _scope_of(kind, path)
    return parse_typed(schema, content, path, error=ScenarioError, overrides=overrides, scope=scope)


def _scope_of(kind: str, path: Path) -> Callable[[Any], Scope]:
    """What finds a scenario's robot or mechanism."""

    def scope(scenario: Any) -> Scope:
        found = (mechanism_scope if kind == MECHANISM else robot_scope)(scenario, path)
        if kind != MECHANISM:
            check_robot_motion(found.robot, path)
        return replace(found, more=SCENARIO_SCHEMAS[kind][1])

    return scope
