"""Names of the front door, what its results show, robots and poses in all their forms."""

import ast
import inspect
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame.result import Result
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.schema.typed_yaml import dump_typed
from cdpr_drake.summaries import Summarized
from tests.analyses.verbs.verb_checks import HOMES, RESULTS, as_json, one_line, shows_itself

PROMISED = """
    __version__ load_robot robot_names load_scenario scenario_names Robot Scenario CableSet Pose
    import_robot export_robot simulate repeat_run run_many serve finish_run
    solve_tensions distribute
    TensionProblem TensionSolution TENSION_METHODS solve_static find_equilibria
    solve_forward_kinematics solve_inverse_kinematics plot compute_workspace assess_stability
    plan_path plan_free_motion reconfigure plan_proven_motion calibrate identify optimize_design
    studies run_study reproduce CableRobot CompiledCableRobot add_robot add_cable_robot
    CableRobotSettings add_target add_camera add_visual_servo add_estimator add_tension_control
    build_visual_servo VisualServoSettings RemoteClient CdprError StoppedError
"""


def test_all_results_tell_draw_and_show_themselves():
    """That they do it well is tested with each."""
    assert RESULTS
    for kind in RESULTS:
        assert issubclass(kind, Summarized | Result), kind
        assert not inspect.isabstract(kind) or kind.__subclasses__(), kind
        for method in ("as_dict", "plot"):
            assert inspect.isfunction(getattr(kind, method, None)), f"{kind}: {method}"


def test_what_does_not_say_what_it_shows_cannot_be_made():
    with pytest.raises(TypeError, match="summary"):
        type("Silent", (Summarized,), {})()


def test_what_was_promised_is_there():
    assert set(cdpr.__all__) >= {*PROMISED.split()}
    for name in cdpr.__all__:
        assert getattr(cdpr, name) is getattr(import_module(f"cdpr_drake.{HOMES[name]}"), name)


def test_names_are_no_packages():
    """A package of the same name would take the place of a function once it is imported."""
    folder = Path(cdpr.__file__).parent
    assert not [name for name in cdpr.__all__ if (folder / name).exists()]


def test_the_import_is_light():
    program = (
        "import sys, cdpr_drake as cdpr; cdpr.__version__, cdpr.CdprError, dir(cdpr);"
        "print(sorted(n for n in sys.modules if n.startswith('cdpr_drake')));"
        "print([n for n in ('numba', 'numpy', 'pydrake', 'matplotlib') if n in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    own, heavy = map(ast.literal_eval, done.stdout.splitlines())
    assert heavy == []
    assert len(own) <= 6, own


def test_a_robot_by_name_path_and_itself(planar, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(dump_typed(planar))
    told = [as_json(cdpr.solve_tensions(one)) for one in ("planar", str(path), path, planar)]
    assert told[1:] == told[:1] * 3
    one_line(lambda: cdpr.solve_tensions("planer"), "'planer'", "planar")
    one_line(lambda: cdpr.solve_tensions(3), "robot", "int")
    assert "planar" in shows_itself(planar)


def test_poses_in_all_their_forms(planar, aside):
    X_WP = aside.transform()
    told = [as_json(cdpr.solve_tensions(planar, one)) for one in (aside, X_WP, X_WP.GetAsMatrix4())]
    assert told[1:] == told[:1] * 2
    at_home = as_json(cdpr.solve_tensions(planar))
    assert at_home == as_json(cdpr.solve_tensions(planar, planar.home.transform()))
    assert at_home != told[0]
    for wrong in (np.zeros((3, 3)), "home", 2 * np.eye(4), np.zeros((4, 4)), [[1.0], [1.0, 2.0]]):
        one_line(lambda wrong=wrong: cdpr.solve_tensions(planar, wrong), "pose: found")
    one_line(lambda: cdpr.solve_tensions(planar, RigidTransform([9.0, 0.0, 0.3])), "outside")


def test_robots_go_out_and_come_back(tmp_path):
    ((name, text),) = cdpr.export_robot("acrobot_large", "mjcf").items()
    (tmp_path / name).write_text(text)
    imported = cdpr.import_robot(tmp_path / name)
    assert "acrobot_large" in shows_itself(imported)
    assert as_json(imported)["cables"] == 8
    back = imported.robot
    there = load_robot("acrobot_large")
    np.testing.assert_allclose(back.exit_points(), there.exit_points(), atol=1e-9)
    one_line(lambda: cdpr.export_robot("acrobot_large", "docx"), "docx")


def test_scenario_names():
    kinds = ("visual_servo", "tension_control", "pick_and_place", "mechanism")
    by_kind = [name for kind in kinds for name in cdpr.scenario_names(kind)]
    assert sorted(by_kind) == list(cdpr.scenario_names())
    one_line(lambda: cdpr.scenario_names("dance"), "dance")


def test_twenty_tasks_take_five_lines_each():
    """That they run is tested with all pages."""
    page = Path(__file__).parents[3] / "docs" / "howto" / "twenty_tasks.md"
    first, *tasks = re.findall(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)
    assert first == "import cdpr_drake as cdpr\n"
    assert len(tasks) == 20
    for task in tasks:
        assert len(task.splitlines()) <= 5, task
        assert "import " not in task
        assert set(re.findall(r"cdpr\.(\w+)", task)) <= set(cdpr.__all__)
