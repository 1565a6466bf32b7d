"""A loop that ends hanging on five cables arrives with tension management.

It does so if the mass is in the middle of the platform's box. With the fitted centre of mass of
the robot's file, 30 mm below, the same loop arrives by itself, on six cables.
"""

from importlib.resources import files

import numpy as np
import pytest
import yaml

from cdpr_drake.analyses.simulation.run_stability import stability_along
from cdpr_drake.analyses.simulation.visual_servo_run import run_scenario
from cdpr_drake.analyses.studies.closed_loops.loops import SETTINGS, loop_setup, perturbation_of
from cdpr_drake.analyses.studies.framework.servo_models import perturbed_scenario, perturbed_servo
from cdpr_drake.geometry.poses import pose_from_angles, pose_row
from cdpr_drake.systems.diagrams.load import load_scenario

SCHEME = "pbvs-line"
START = pose_from_angles(
    np.array([0.07004729, -0.28586191, 1.0559333]),
    np.radians([10.97339115, 10.825974, -29.56824256]),
)
"""0.1 m below the exit points, where slack moves between cables at once."""

LONG_ENOUGH = 16.0
"""With tension management it arrives within 14 s; without, it hangs on five cables [s]."""

MIDDLE = [0.0, 0.0, 0.035]
"""Centre of mass in the middle of the platform's box [m]."""

FITTED = "acrobot_large"


@pytest.fixture(scope="module")
def high(tmp_path_factory):
    """File of the robot with its mass in the middle of the box."""
    shipped = files("cdpr_drake.models").joinpath(f"robots/{FITTED}/robot.yaml")
    content = yaml.safe_load(shipped.read_text(encoding="utf-8"))
    content["platform"]["center_of_mass"] = MIDDLE
    path = tmp_path_factory.mktemp("high") / "robot.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def worst():
    """The worst errors that a search finds at the start, as in the study."""
    setup = loop_setup(SCHEME)
    found = perturbation_of(setup, pose_row(START), worst=True)
    # Stable, says the criterion, which takes every cable as taut.
    assert perturbed_servo(setup.scenario, found).margin(START) > 0.0
    return found


def ended(robot, worst, managed):
    """How the loop ends with a robot, and how many cables pull on its way."""
    section = "{threshold: [1.0], gain: 0.003}" if managed else "null"
    scenario = load_scenario(
        "acrobot_pbvs",
        [
            *SETTINGS,
            f"robot={robot}",
            f"controller.scheme={SCHEME}",
            f"duration={LONG_ENOUGH}",
            "integration.engine=compiled",
            f"tension_management={section}",
        ],
    )
    made = perturbed_scenario(scenario, START, worst)
    made.estimator.kind = "shifted"
    made.sensors.tracker = "ideal"
    result = run_scenario(made)
    return result.outcome.name, stability_along(result)


@pytest.mark.parametrize("managed", [False, True])
def test_whether_it_arrives(high, worst, managed):
    outcome, along = ended(high, worst, managed)
    if managed:
        assert outcome == "CONVERGED"
        assert along.taut[-1] == 8
        assert along.underactuated_time() < 2.0
    else:
        assert outcome == "TIMEOUT"
        assert along.taut[-1] == 5
        assert along.underactuated_time() > 0.5 * LONG_ENOUGH


def test_with_the_fitted_centre_of_mass_it_arrives_by_itself(worst):
    outcome, along = ended(FITTED, worst, managed=False)
    assert outcome == "CONVERGED"
    assert along.taut[-1] == 6
