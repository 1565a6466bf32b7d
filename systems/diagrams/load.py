"""Loads scenarios of every kind and checks them against their robots."""

from collections.abc import Sequence

from cdpr_drake.errors import CableGeometryError, ScenarioError, TensionProblemError
from cdpr_drake.models import check_pulleys, tension_problem
from cdpr_drake.systems.diagrams.scenario_checks import check_scenario
from cdpr_drake.systems.scenarios import Scenario, TensionScenario, load_with_robot
from cdpr_drake.tensions import distribute


def load_scenario(name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Reads a scenario by name or by path to a YAML file, and checks it against its robot.

    Args:
        name: Name or path.
        overrides: Items "key.subkey=value" that replace what the file says.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its robot cannot do what it asks.
        RobotFileError: Its robot's file does not describe a possible robot.
    """
    scenario, robot, path = load_with_robot(Scenario, name, overrides)
    check_scenario(scenario, robot, path)
    return scenario


def load_tension_scenario(name: str, overrides: Sequence[str] = ()) -> TensionScenario:
    """Reads a scenario of dynamic control by name or by path, and checks it against its robot.

    Args:
        name: Name or path.
        overrides: Items "key.subkey=value" that replace what the file says.

    Raises:
        ScenarioError: Unknown or malformed scenario, or its robot cannot do what it asks.
        RobotFileError: Its robot's file does not describe a possible robot.
    """
    scenario, robot, path = load_with_robot(TensionScenario, name, overrides)
    if not scenario.trajectory.stretches:
        raise ScenarioError(f"{path}: trajectory.stretches: found none; accepted: at least one")
    poses = {"trajectory.start": scenario.trajectory.start}
    for k, stretch in enumerate(scenario.trajectory.stretches):
        poses[f"trajectory.stretches[{k}].pose"] = stretch.pose
    cables = scenario.cable_set(robot)
    for key, pose in poses.items():
        try:
            if scenario.cables.pulleys:
                check_pulleys(robot, pose.transform(), cables)
            problem_there = tension_problem(
                robot,
                pose.transform(),
                limits=scenario.limits(),
                reference=scenario.reference_tensions(robot),
                cables=cables,
            )
            solution = distribute(problem_there, "quadratic_program")
            distribute(problem_there, scenario.distribution.method)
        except (CableGeometryError, TensionProblemError) as problem:
            raise ScenarioError(f"{path}: {key}: {problem}") from problem
        if solution.status != "feasible":
            low, high = problem_there.lower[0], problem_there.upper[0]
            raise ScenarioError(
                f"{path}: {key}: found {pose.position.tolist()} m, where no tensions within "
                f"{low:g}..{high:g} N hold the platform; accepted: a pose that can be held"
            )
    return scenario
