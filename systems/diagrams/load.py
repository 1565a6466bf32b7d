"""Loads scenarios of any kind and checks them against their robots; a new kind is one entry of
`SCENARIO_SCHEMAS`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.control.force_balance import FORCE, WRENCH, force_problem
from cdpr_drake.errors import (
    CableGeometryError,
    Problems,
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
from cdpr_drake.systems.controllers.force_tracking import check_force_control
from cdpr_drake.systems.diagrams.mechanism_control import check_mechanism_scenario
from cdpr_drake.systems.diagrams.scenario_checks import check_scenario
from cdpr_drake.systems.remote.remote_place import TENSION_PLACES
from cdpr_drake.systems.remote.settings import check_place
from cdpr_drake.systems.robots.disturbances import check_disturbances
from cdpr_drake.systems.robots.settings import COMPILED
from cdpr_drake.systems.scenarios.files import (
    MECHANISM,
    PICK_AND_PLACE,
    TENSION_CONTROL,
    VISUAL_SERVO,
    load_with_mechanism,
    load_with_robot,
    scenario_file,
    scenario_kind,
)
from cdpr_drake.systems.scenarios.mechanism_scenario import MechanismScenario
from cdpr_drake.systems.scenarios.pick_and_place_scenario import (
    PickAndPlaceScenario,
    check_pick_and_place,
)
from cdpr_drake.systems.scenarios.run_settings import ScenarioHeader
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.worlds.checks import check_world
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


def _check_tension_scenario(scenario: TensionScenario, robot: Robot, path: Path) -> None:
    check_place(scenario.remote, TENSION_PLACES, path)
    if robot.winch_groups().are_shared():
        raise ScenarioError(
            f"{path}: robot: found {robot.name} with several cables on one winch, which cannot be "
            "given tensions one by one; accepted: a robot with a winch for each cable"
        )
    poses = _poses_of(scenario, robot, path)
    check_world(
        scenario.world, robot, next(iter(poses.values())), path,
        compiled=scenario.integration.engine == COMPILED, stop=scenario.stop.contact,
    )  # fmt: skip
    if scenario.perturbations.believed_robot is not None:
        for key in ("remote", "predictive"):
            if getattr(scenario, key) is not None:
                raise ScenarioError(
                    f"{path}: perturbations.believed_robot: found beside {key}; accepted: one of "
                    "both"
                )
    check_disturbances(scenario.disturbances, path)
    _check_forces(scenario, robot, path)
    if scenario.predictive is not None and scenario.controller.balance != WRENCH:
        raise ScenarioError(
            f"{path}: controller.balance: found {scenario.controller.balance} beside predictive; "
            f"accepted: {WRENCH}"
        )
    problems, said = Problems(ScenarioError), set()
    for key, X_WP in poses.items():
        words = _why_not_held(X_WP, scenario, robot)
        if words and words not in said:  # settings that are wrong are wrong for every pose
            said.add(words)
            problems.add(f"{path}: {key}: {words}")
    problems.raise_any()


def _check_forces(scenario: TensionScenario, robot: Robot, path: Path) -> None:
    """Refuses laws that answer forces, and pushes, beside what does not go with them."""
    for key in ("force_control", "disturbances"):
        if getattr(scenario, key) is not None and scenario.integration.engine == COMPILED:
            raise ScenarioError(
                f"{path}: integration.engine: found {COMPILED} beside {key}; accepted: plant"
            )
    if scenario.force_control is None:
        return
    try:
        check_force_control(scenario.force_control, robot)
    except ScenarioError as problem:
        raise ScenarioError(f"{path}: {problem}") from problem
    for key in ("remote", "predictive"):
        if getattr(scenario, key) is not None:
            raise ScenarioError(f"{path}: force_control: found beside {key}; accepted: one of both")
    if scenario.controller.balance != WRENCH:
        raise ScenarioError(
            f"{path}: controller.balance: found {scenario.controller.balance} beside "
            f"force_control; accepted: {WRENCH}"
        )


def _poses_of(scenario: TensionScenario, robot: Robot, path: Path) -> dict[str, RigidTransform]:
    """Where the platform rests along a trajectory, by key, at time 0 first [m].

    Between its ends a motion from a file may pass poses that nothing holds; there the platform
    must only be where it can.
    """
    asked = scenario.trajectory
    if asked.file is not None:
        try:
            motion = asked.trajectory()
            for t in np.linspace(motion.start_time, motion.end_time, FILE_LOOKS):
                check_pose(robot, motion.pose(float(t)))
        except TrajectoryError as problem:
            raise ScenarioError(f"{path}: trajectory.file: {problem}") from problem
        except TensionProblemError as problem:
            raise ScenarioError(
                f"{path}: trajectory.file: {asked.file}: at {t:.4g} s: {problem}"
            ) from problem
        if scenario.duration <= motion.start_time:
            raise ScenarioError(
                f"{path}: duration: found {scenario.duration:g} s; accepted: longer than "
                f"{motion.start_time:g} s, when the motion of trajectory.file begins"
            )
        return {
            "trajectory.file, its start": motion.poses[0],
            "trajectory.file, its end": motion.poses[-1],
        }
    if asked.start is None:
        raise ScenarioError(
            f"{path}: trajectory.start: found none; accepted: a pose, or trajectory.file"
        )
    if not asked.stretches:
        raise ScenarioError(f"{path}: trajectory.stretches: found none; accepted: at least one")
    poses = {"trajectory.start": asked.start.transform()}
    for k, stretch in enumerate(asked.stretches):
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


SCENARIO_SCHEMAS: dict[str, tuple[type[Any], Callable[[Any, Any, Path], None]]] = {
    VISUAL_SERVO: (Scenario, check_scenario),
    TENSION_CONTROL: (TensionScenario, _check_tension_scenario),
    PICK_AND_PLACE: (PickAndPlaceScenario, check_pick_and_place),
    MECHANISM: (MechanismScenario, check_mechanism_scenario),
}
"""Schema of each kind of scenario, and its check against robot or mechanism, by what its file gives
as `kind`."""


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
    of_kind, check = SCENARIO_SCHEMAS[kind]
    if schema is not None and not issubclass(schema, of_kind):
        raise ScenarioError(
            f"{scenario_file(name)}: kind: found {kind}, not described by {schema.__name__}; "
            f"accepted: {of_kind.__name__}, or a subclass of it with more sections"
        )
    if not issubclass(of_kind, ScenarioHeader):
        scenario, mechanism, path = load_with_mechanism(schema or of_kind, name, overrides)
        check(scenario, mechanism, path)
        return scenario
    scenario, robot, path = load_with_robot(schema or of_kind, name, overrides)
    check_robot_motion(robot, path)
    check(scenario, robot, path)
    return scenario
