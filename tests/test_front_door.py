"""`import cdpr_drake as cdpr`: its names, and its calls against those that they stand for."""

import ast
import inspect
import json
import re
import subprocess
import sys
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.common.yaml import yaml_dump_typed
from pydrake.math import RigidTransform

import cdpr_drake as cdpr
from cdpr_drake.analyses.calibration.calibration_report import calibration_dict
from cdpr_drake.analyses.calibration.calibration_request import CalibrationTask
from cdpr_drake.analyses.calibration.calibration_task import calibrate as calibrate_log
from cdpr_drake.analyses.calibration.identification_report import identification_dict
from cdpr_drake.analyses.calibration.identification_task import IdentificationTask
from cdpr_drake.analyses.calibration.identification_task import identify as identify_log
from cdpr_drake.analyses.calibration.log_file import read_log
from cdpr_drake.analyses.front.session import Session
from cdpr_drake.analyses.front.simulation import RepeatedRuns, Run
from cdpr_drake.analyses.planning.robot_path_task import LimitSettings, make_path, path_task
from cdpr_drake.analyses.simulation.tension_control_run import (
    run_tension_scenario,
    summarize_tension_run,
)
from cdpr_drake.analyses.statics.equilibria_query import equilibria_at_lengths
from cdpr_drake.analyses.statics.static_query import static_at_lengths, static_at_pose
from cdpr_drake.analyses.statics.tension_query import underactuated_answer
from cdpr_drake.analyses.studies.catalogue import STUDIES, StudyEntry
from cdpr_drake.analyses.workspaces.stability_question import make_question
from cdpr_drake.analyses.workspaces.stability_results import stability_workspaces
from cdpr_drake.analyses.workspaces.workspace_question import (
    WorkspaceRequest,
    interference_bodies,
    make_workspace_question,
)
from cdpr_drake.analyses.workspaces.workspace_results import robot_workspace
from cdpr_drake.cli.app import main
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_statics import tension_problem, wrench_balance
from cdpr_drake.planning.path_timing import plan_along_path
from cdpr_drake.stability.verdict import VerdictOptions
from cdpr_drake.statics.forward_kinematics import ForwardKinematics
from cdpr_drake.summaries import MOST_LINES, Summarized
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.tensions.methods import METHODS, distribute
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet
from tests.identification.logs import log as motion_log
from tests.messages import printed

STUB = Path(cdpr.__file__).with_suffix(".pyi")
HOMES = {
    alias.name: node.module for node in ast.parse(STUB.read_text()).body for alias in node.names
}
"""Names of the front door, with the module of each."""

PROMISED = {
    "__version__",
    "load_robot",
    "robot_names",
    "load_scenario",
    "scenario_names",
    "Robot",
    "Scenario",
    "CableSet",
    "Pose",
    "import_robot",
    "export_robot",
    "simulate",
    "continue_run",
    "finish_run",
    "Session",
    "solve_tensions",
    "distribute",
    "TensionProblem",
    "TensionSolution",
    "TENSION_METHODS",
    "solve_static",
    "find_equilibria",
    "solve_forward_kinematics",
    "compute_workspace",
    "assess_stability",
    "plan_path",
    "plan_free_motion",
    "reconfigure",
    "plan_proven_motion",
    "calibrate",
    "identify",
    "optimize_design",
    "studies",
    "run_study",
    "reproduce",
    "CableRobot",
    "CompiledCableRobot",
    "add_robot",
    "add_cable_robot",
    "CableRobotSettings",
    "add_target",
    "add_camera",
    "add_visual_servo",
    "add_estimator",
    "add_tension_control",
    "build_visual_servo",
    "VisualServoSettings",
    "RemoteClient",
    "CdprError",
    "StoppedError",
}


@pytest.fixture(scope="module")
def planar():
    return load_robot("planar")


@pytest.fixture(scope="module")
def aside(planar):
    return cdpr.Pose(
        position=np.array([0.1, -0.05, planar.plane_height]), angles_deg=np.array([0.0, 0.0, 5.0])
    )


def shows_itself(result):
    """In a few lines, as text and as HTML; what a verb returned also for JSON, and as a figure."""
    if type(result) in RESULTS:
        assert as_json(result)
        assert isinstance(result.plot(), Figure)
    lines = repr(result).splitlines()
    assert 2 <= len(lines) <= MOST_LINES
    assert " object at 0x" not in repr(result)
    assert result._repr_html_().count("<tr>") >= len(lines) - 1
    return repr(result)


def verbs():
    """Functions of the front door that answer, by name."""
    homes = {name: home for name, home in HOMES.items() if home.startswith("analyses.front.")}
    return {n: getattr(cdpr, n) for n in homes if inspect.isfunction(getattr(cdpr, n))}


def result_classes():
    """What the verbs return; `simulate` says so in words, since mypy could not tell which."""
    found = {Run, RepeatedRuns}
    for verb in verbs().values():
        told = get_type_hints(verb)["return"]
        found |= {one for one in (get_args(told) or (told,)) if inspect.isclass(one)}
    return found - {tuple, str, Any}


RESULTS = result_classes()


def test_all_results_tell_draw_and_show_themselves():
    """That they do it well is tested with each."""
    assert len(RESULTS) >= 16
    for kind in RESULTS:
        assert issubclass(kind, Summarized), kind
        assert not inspect.isabstract(kind), kind
        for method in ("as_dict", "plot"):
            assert inspect.isfunction(getattr(kind, method, None)), f"{kind}: {method}"


def test_what_does_not_say_what_it_shows_cannot_be_made():
    with pytest.raises(TypeError, match="summary"):
        type("Silent", (Summarized,), {})()


def as_json(result):
    return json.loads(json.dumps(result.as_dict()))


def one_line(call, *words):
    """A call that is refused with one line that has these words."""
    with pytest.raises(cdpr.CdprError) as problem:
        call()
    assert "\n" not in str(problem.value)
    for word in words:
        assert word in str(problem.value)


def test_what_was_promised_is_there():
    assert set(cdpr.__all__) >= PROMISED
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
    path.write_text(yaml_dump_typed(planar))
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


def test_tensions(planar, aside):
    push = np.array([0.0, 0.0, 0.1, 2.0, 0.0, 0.0])
    problem = tension_problem(planar, aside.transform(), push)
    found = cdpr.solve_tensions(planar, aside, push, "infinity_norm")
    expected = distribute(problem, "infinity_norm")
    np.testing.assert_array_equal(found.tensions, expected.tensions)
    assert found.as_dict() == {"robot": "planar", "redundancy": 1} | expected.as_dict()
    assert "*" in shows_itself(found)
    assert "feasible" in shows_itself(expected)
    every = cdpr.compare_tensions(planar, aside, push)
    assert [one.method for one in every.solutions] == [
        name for name, method in METHODS.items() if method.takes(1) and not method.needs_reference
    ]
    shows_itself(every)
    assert isinstance(every.plot_wrenches(), Figure)
    given = {"limits": (2.0, 30.0), "length_scale": 0.1, "mass": 2.0}
    relaxed = cdpr.solve_tensions(planar, aside, push, "slack_relaxed", **given)
    problem = tension_problem(planar, aside.transform(), push, **given)
    assert relaxed.solution.as_dict() == distribute(problem, "slack_relaxed").as_dict()
    wanted = cdpr.solve_tensions(planar, method="reference_program", reference=6.0)
    assert np.max(np.abs(wanted.tensions - 6.0)) < 1.0
    one_line(lambda: cdpr.solve_tensions(planar, method="dijkstra"), "dijkstra", "dykstra")


def test_tensions_of_fewer_cables():
    robot = load_robot("grab_three")
    found = cdpr.solve_tensions(robot)
    balance = wrench_balance(robot, robot.home.transform())
    assert found.as_dict() == underactuated_answer(robot, balance)
    assert found.tensions.shape == (3,)
    shows_itself(found)
    one_line(lambda: cdpr.solve_tensions(robot, method="dykstra"), "quadratic_program")


def test_rest_at_a_pose_and_with_lengths(planar, aside):
    held = cdpr.solve_static(planar, aside)
    assert as_json(held) == json.loads(
        json.dumps(static_at_pose(planar, aside.transform(), "elastic", True).as_dict())
    )
    assert "stable" in shows_itself(held)
    assert isinstance(held.plot(), Figure)
    hanging = cdpr.solve_static(planar, lengths=list(held.l0))
    assert hanging.as_dict() == static_at_lengths(planar, held.l0, "elastic", True).as_dict()
    one_line(lambda: cdpr.solve_static(planar, aside, held.l0), "both")
    one_line(lambda: cdpr.solve_static(planar, lengths=[1.0, 1.0]), "shape (2,)")
    one_line(lambda: cdpr.solve_static(planar, model="rubber"), "rubber")


def test_all_poses_of_rest():
    robot = load_robot("spider_camera")
    cables = robot.cable_set().without_pulleys()
    lengths = cable_paths(robot.home.transform(), cables).lengths
    found = cdpr.find_equilibria(robot, lengths)
    assert found.as_dict() == equilibria_at_lengths(robot, lengths).as_dict()
    shows_itself(found)
    three = load_robot("grab_three")
    shows_itself(cdpr.find_equilibria(three, position=three.home.position))
    one_line(lambda: cdpr.find_equilibria(robot), "neither")
    one_line(lambda: cdpr.find_equilibria(robot, position=[0, 0, 0.3], taut=["C9"]), "C9")
    one_line(lambda: cdpr.find_equilibria(robot, lengths, taut=["C1"]), "taut")
    one_line(lambda: cdpr.find_equilibria(robot, lengths, searches=0), "searches")


def test_a_pose_from_lengths(planar, aside):
    solver = ForwardKinematics(planar.cable_set(), planar.motion_type())
    lengths = solver.lengths(aside.transform())
    found = cdpr.solve_forward_kinematics(planar, lengths)
    expected = solver.pose(lengths, planar.home.transform())
    np.testing.assert_array_equal(found.X_WP.GetAsMatrix4(), expected.X_WP.GetAsMatrix4())
    np.testing.assert_allclose(found.X_WP.translation(), aside.position, atol=1e-6)
    assert as_json(found)["lengths_m"] == lengths.tolist()
    assert "residuals" in shows_itself(found)
    one_line(lambda: cdpr.solve_forward_kinematics(planar, 9.0 * lengths), "")
    one_line(lambda: cdpr.solve_forward_kinematics(planar, -lengths), "lengths")


def test_workspaces(planar):
    found = cdpr.compute_workspace(
        planar, "wrench-feasible", (3, 3, 1), measures="capacity-margin", force=2.0
    )
    question = make_workspace_question(
        "planar", ["wrench-feasible"], found.grid, ["capacity-margin"], "all",
        WorkspaceRequest(
            required=forces(2.0), pulleys=True, around=interference_bodies(planar, pulleys=True)
        ),
    )  # fmt: skip
    expected = robot_workspace(question).workspace
    assert as_json(found) == json.loads(json.dumps(expected.as_dict()))
    np.testing.assert_array_equal(found.inside(), expected.inside())
    assert np.any(found.inside())
    shows_itself(found)
    assert isinstance(found.plot("capacity-margin"), Figure)
    assert as_json(found) == as_json(
        cdpr.compute_workspace(
            "planar", ["wrench-feasible"], (3, 3, 1), measures=["capacity-margin"], force=2.0
        )
    )
    one_line(lambda: cdpr.compute_workspace(planar, "wide"), "kinds 'wide'")
    one_line(lambda: cdpr.compute_workspace(planar, measures="wide"), "measures 'wide'")
    one_line(lambda: cdpr.compute_workspace(planar, clearance=-1.0), "clearance: found")
    one_line(lambda: cdpr.compute_workspace(planar, "wrench-feasible"), "needs required, force")
    one_line(lambda: cdpr.compute_workspace(planar, grid=(3, 3)), "grid")
    one_line(lambda: cdpr.compute_workspace(planar, forse=1.0), "forse", "force")


def test_a_workspace_as_hull_and_boxes_in_a_folder(tmp_path, monkeypatch, capsys):
    """The call and the command find, write and print the same, and continue each other's work."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "push.yaml").write_text("box: [0, 0, 0, 1, 1, 1]\n")
    said, seen = [], []
    found = cdpr.compute_workspace(
        "acrobot_large", "wrench-feasible", (3, 3, 3), required="push.yaml", box=BOX,
        hull=[0, 0, 0.3], rays=300, certify=True, boxes=600, exit_error=1e-4, boxes_mesh="b.vtu",
        folder="call", formats=("svg",), session=Session(seen.append, say=said.append),
    )  # fmt: skip
    told = as_json(found)
    assert told == json.loads(Path("call/results.json").read_text())
    assert {one.items for one in seen} == {"poses", "boxes"}
    assert said == ["Casting rays", "Writing results"]
    assert found.failed == {}
    assert not found.interrupted
    lines = shows_itself(found)
    assert "hull" in lines
    command = [
        "workspace", "acrobot_large", "--kind", "wrench-feasible", "--wrench-set", "push.yaml",
        "--grid", "3,3,3", "--box=-0.5:0.5,-0.5:0.5,0:1", "--hull", "0,0,0.3", "--rays", "300",
        "--certify", "--boxes", "600", "--exit-error", "1e-4", "--boxes-mesh", "c.vtu",
        "--format", "svg", "--workers", "1", "--json", "--out",
    ]  # fmt: skip
    for folder, words in (("call", "complete already"), ("command", "cables over")):
        with pytest.raises(SystemExit) as end:
            main([*command, folder])
        assert end.value.code == 0
        shown = printed(capsys)
        assert json.loads(shown.out) == told
        assert words in shown.err
    names = [
        sorted(path.name for path in Path(one).iterdir() if path.is_file())
        for one in ("call", "command")
    ]
    assert names[0] == names[1]
    assert {"workspace.npz", "hull.npz", "boxes.npz", "planes.svg", "workspace.html"} < {*names[0]}
    for one in ("workspace.npz", "hull.npz", "boxes.npz", "planes.svg", "../b.vtu"):
        other = Path("command", one.replace("b.vtu", "c.vtu"))
        assert Path("call", one).read_bytes() == other.read_bytes()
    Path("copy").mkdir()
    assert found.write(Path("copy"), ("svg",)) == {}
    assert Path("copy/workspace.npz").read_bytes() == Path("call/workspace.npz").read_bytes()


BOX = ([-0.5, -0.5, 0.0], [0.5, 0.5, 1.0])


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"hull": (0, 0)}, ["hull: found (0, 0)"]),
        ({"hull": (0, 0, 0.3)}, ["hull: found the planar"]),
        ({"unbounded": True}, ["unbounded: needs hull"]),
        ({"unbounded": True, "hull": (0, 0, 0.3), "box": BOX}, ["unbounded: found box"]),
        ({"mesh": "a.stl"}, ["mesh: needs hull"]),
        ({"certify": True, "boxes_mesh": "a.stl"}, ["a.stl", "vtu"]),
        ({"certify": True, "boxes": 0}, ["boxes: found 0"]),
        ({"certify": True, "kinds": ("static", "stable")}, ["certify: found kinds static,stable"]),
        ({"certify": True, "orientations": "any"}, ["certify: found orientations any"]),
        ({"certify": True, "method": "closed_form"}, ["certify: found method closed_form"]),
        ({"certfy": True}, ["certfy", "certify"]),
        ({"box": (BOX[1], BOX[0])}, ["box: accepted: lower below upper"]),
        ({"required": "no.yaml"}, ["no.yaml", "no such file"]),
        ({"required": "no.yaml", "force": 1.0}, ["required: found force or moment too"]),
    ],
)
def test_what_a_workspace_cannot_be_asked_for(planar, tmp_path, asked, words):
    one_line(lambda: cdpr.compute_workspace(planar, folder=tmp_path / "w", **asked), *words)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("verb", ["compute_workspace", "assess_stability"])
def test_a_question_over_a_grid_that_is_stopped_goes_on(planar, tmp_path, verb):
    asked = {"assess_stability": {"verdict": "sampled", "options": {"draws": 2}}}.get(verb, {})
    call = partial(getattr(cdpr, verb), planar, grid=(3, 3, 1), folder=tmp_path / "w", **asked)
    with pytest.raises(cdpr.StoppedError, match=r"stopped after 0 of (9|18) poses"):
        call(session=Session(should_stop=lambda: True))
    assert not (tmp_path / "w" / "results.json").exists()
    assert as_json(call()) == json.loads((tmp_path / "w" / "results.json").read_text())
    seen = []
    again = call(session=Session(seen.append))
    assert [one.found for one in seen] == [seen[0].total]
    assert again.folder == tmp_path / "w"
    assert again.failed == {}


def forces(force):
    return SpatialSet(box=np.array([0.0, 0.0, 0.0, force, force, force]))


def test_stability(planar):
    found = cdpr.assess_stability(
        planar, verdict="sampled", grid=(3, 3, 1), options={"draws": 5}, vary={"r_A": [0.01]}
    )
    question = make_question(
        "planar", verdict="sampled", grid=found.grid, options=VerdictOptions(draws=5),
        vary={"r_A": [0.01]},
    )  # fmt: skip
    expected = stability_workspaces(question).workspaces
    assert as_json(found) == json.loads(json.dumps(expected.as_dict()))
    np.testing.assert_array_equal(found.margin, expected.margin)
    assert "r_A=0.01" in shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.assess_stability(planar, options={"drawn": 5}), "drawn", "draws")
    one_line(lambda: cdpr.assess_stability(planar, verdict="guessed"), "guessed")
    one_line(lambda: cdpr.assess_stability(planar, force=1.0), "force")


def test_a_robot_and_its_name_have_one_grid_and_one_task(planar):
    """What a catalogue or a scenario adds to a robot does not depend on how it is given."""
    both = [cdpr.compute_workspace(one, "static").grid.shape for one in (planar, "planar")]
    assert both[0] == both[1]
    asked = {"grid": (2, 2, 1), "verdict": "sampled", "options": {"draws": 2}}
    seen = [
        as_json(cdpr.assess_stability(one, scenario="planar_pbvs", **asked))
        for one in (planar, "planar")
    ]
    assert seen[0] == seen[1]


def test_a_plan(planar, aside):
    found = cdpr.plan_path(planar, [None, aside], {"speed": 0.5}, stations=60)
    given = LimitSettings(speed=0.5)
    way = make_path(planar, [planar.home.transform(), aside.transform()], "smooth")
    expected = plan_along_path(path_task(planar, given), way, 60)
    assert found.plan.duration == expected.duration
    told = as_json(found)
    assert told["duration_s"] == expected.duration
    assert told["arguments"]["speed_m_s"] == 0.5
    assert "waypoints" in shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.plan_path(planar, [None]), "1 poses")
    one_line(lambda: cdpr.plan_path(planar, "no.csv"), "no.csv")
    one_line(lambda: cdpr.plan_path(planar, [None, aside], {"sped": 1.0}), "sped", "speed")
    one_line(lambda: cdpr.plan_free_motion(planar, None, aside, last="time"), "last", "least")


def test_a_run(tmp_path):
    asked = ["duration=0.2", "integration.engine=compiled"]
    seen = []
    session = Session(on_progress=lambda now: seen.append(now.sim_time))
    found = cdpr.simulate("planar_computed_torque", asked, session=session)
    assert seen
    assert max(seen) <= 0.2
    scenario = load_scenario("planar_computed_torque", asked)
    expected = summarize_tension_run(run_tension_scenario(scenario))
    same = ("outcome", "sim_time_s", "position_error_m", "tension_n")
    assert {k: found.as_dict()[k] for k in same} == {k: expected[k] for k in same}
    assert found.log["tensions"].shape[1] == 4
    assert "outcome" not in shows_itself(found)
    assert isinstance(found.plot(), Figure)
    stopped = cdpr.simulate(scenario, session=Session(should_stop=lambda: True))
    assert stopped.as_dict()["outcome"] == "interrupted"
    one_line(lambda: cdpr.simulate(scenario, video=True), "video")
    one_line(lambda: cdpr.simulate(scenario, log_formats=["xls"]), "log_formats", "xls")
    one_line(lambda: cdpr.finish_run(tmp_path / "none"), "none")
    kept = cdpr.simulate(scenario, folder=tmp_path / "run", formats=("svg",))
    assert kept.failed == {}
    written = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert written == as_json(kept)
    assert (tmp_path / "run" / "error.svg").is_file()
    one_line(lambda: cdpr.simulate(scenario, ["duration=1"]), "overrides")
    one_line(lambda: cdpr.simulate(scenario, seeds=[1, 2]), "seeds")
    one_line(lambda: cdpr.simulate("planar_pbsv"), "planar_pbvs")


def test_runs_over_seeds():
    asked = ["duration=0.2", "camera.kind=projected"]
    found = cdpr.simulate("planar_pbvs", asked, seeds=[3, 5], workers=1)
    assert found.as_dict()["seeds"] == [3, 5]
    assert "2 of 2 runs" in shows_itself(found)
    one_line(lambda: cdpr.simulate("planar_pbvs", asked, seeds=[3, 3]), "different")


def tracked_poses(robot, path):
    """A log of exact lengths and poses of a robot whose first exit point is 5 mm off."""
    rng = np.random.default_rng(0)
    true = load_robot(robot.name)
    true.cables[0].exit_point = true.cables[0].exit_point + np.array([0.005, 0.0, 0.0])
    names = [cable.name for cable in robot.cables]
    header = [f"{name}_length_m" for name in names]
    rows = []
    for k in range(12):
        x, y = rng.uniform(-0.15, 0.15, 2)
        z = robot.plane_height
        pose = cdpr.Pose(
            position=np.array([x, y, z]), angles_deg=np.array([0.0, 0.0, rng.uniform(-8.0, 8.0)])
        )
        lengths = cable_paths(pose.transform(), true.cable_set()).lengths
        rows.append([k, *lengths, x, y, z, *pose.angles_deg])
    header = ["time_s", *header, "x_m", "y_m", "z_m", "phi_deg", "theta_deg", "psi_deg"]
    lines = [",".join(header), *(",".join(f"{value:.15g}" for value in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_calibration(planar, tmp_path):
    path = tracked_poses(planar, tmp_path / "log.csv")
    asked = ("C1.exit_point.x", "C1.exit_point.y")
    found = cdpr.calibrate(planar, path, asked)
    log = read_log(path, [cable.name for cable in planar.cables])
    expected = calibrate_log(CalibrationTask(robot=planar, unknown=asked), log)
    told, wanted = as_json(found), json.loads(json.dumps(calibration_dict(expected)))
    assert told.pop("seconds") > 0.0
    assert told == {key: value for key, value in wanted.items() if key != "seconds"}
    moved = found.robot().cables[0].exit_point - planar.cables[0].exit_point
    np.testing.assert_allclose(moved, [0.005, 0.0, 0.0], atol=1e-4)
    shows_itself(found)
    assert isinstance(found.plot(), Figure)
    out = tmp_path / "out"
    kept = cdpr.calibrate(planar, path, asked, folder=out, formats=("svg",))
    assert kept.folder == out
    assert {path.name for path in out.glob("*.svg")} == {"calibration.svg", "correlation.svg"}
    assert json.loads((out / "results.json").read_text()) == as_json(kept)
    one_line(lambda: cdpr.calibrate(planar, path, asked, folder=out), "allow overwrite")
    one_line(lambda: cdpr.calibrate(planar, path, asked, propose=0), "propose: found 0")
    one_line(lambda: cdpr.calibrate(planar, path, asked, sigmas={"length": 1.0}), "lengths")
    one_line(lambda: cdpr.calibrate(planar, path, asked, prior={}), "prior", "priors")
    one_line(lambda: cdpr.calibrate(planar, tmp_path / "no.csv"), "no.csv")


def test_an_identification(tmp_path):
    robot = load_robot("acrobot_large")
    time, poses, tensions = motion_log(span=4.0, tension=0.3, place=1e-4, angle=2e-4)
    names = ("qw", "qx", "qy", "qz", "x_m", "y_m", "z_m")
    header = ["time_s", *(f"X_WP.{name}" for name in names)]
    header += [f"measured_tensions.C{k + 1}_n" for k in range(8)]
    rows = np.column_stack([time, poses, tensions])
    path = tmp_path / "motion.csv"
    np.savetxt(path, rows, delimiter=",", header=",".join(header), comments="", fmt="%.12g")
    found = cdpr.identify(robot, path, pulleys=False)
    log = read_log(path, [cable.name for cable in robot.cables])
    expected = identify_log(IdentificationTask(robot=robot, pulleys=False), log)
    np.testing.assert_array_equal(found.result.values, expected.result.values)
    assert found.as_dict()["parameters"] == identification_dict(expected)["parameters"]
    assert "mass" in shows_itself(found)
    one_line(lambda: cdpr.identify(robot, path, bandwith=3.0), "bandwith", "bandwidth")


def test_a_design(planar, tmp_path):
    found = cdpr.optimize_design(planar, "capacity-margin", tmp_path / "d", generations=1)
    told = json.loads((tmp_path / "d" / "results.json").read_text())
    assert found.as_dict()["best"] == told["best"]
    assert (tmp_path / "d" / "designs.csv").is_file()
    again = cdpr.optimize_design("planar", "capacity-margin", generations=1)
    assert again.as_dict()["best"] == told["best"]
    shows_itself(found)
    assert isinstance(found.plot(), Figure)
    one_line(lambda: cdpr.optimize_design(planar, "beauty"), "beauty")
    one_line(lambda: cdpr.optimize_design(planar, "no.yaml"), "no.yaml")


class ToyResult:
    interrupted = False

    def as_dict(self):
        return {"quick": True}

    def drawings(self):
        return {"errors": Figure}

    def tables(self):
        return []

    def write(self, folder, formats=()):
        (folder / "results.json").write_text(json.dumps(self.as_dict()))


def test_studies(monkeypatch, tmp_path):
    asked = []

    def study(quick, session):
        asked.append((quick, session.workers))
        return ToyResult()

    monkeypatch.setitem(STUDIES, "case-8", StudyEntry(study))
    assert cdpr.studies() == tuple(STUDIES)
    seen = []
    session = Session(say=seen.append)
    found = cdpr.run_study("case-8", quick=True, workers=1, session=session)
    assert isinstance(found.result, ToyResult)
    assert "Study case-8" in shows_itself(found)
    one_line(lambda: found.plot("ways"), "ways", "errors")
    cdpr.run_study("case-8", tmp_path / "s", quick=True, session=session)
    assert seen == ["Writing results"]
    assert json.loads((tmp_path / "s" / "results.json").read_text()) == {"quick": True}
    found = cdpr.reproduce(tmp_path / "r", quick=True, only=["case-8"])
    assert found.page.is_file()
    assert found.states["case-8"].status == "finished"
    assert json.loads((tmp_path / "r" / "summary.json").read_text())["studies"]
    assert "report" in shows_itself(found)
    assert [quick for quick, _ in asked] == [True] * 3
    one_line(lambda: cdpr.run_study("case-88"), "case-88")
    one_line(lambda: cdpr.run_study("case-8", seeds=3), "seeds")
    one_line(lambda: cdpr.reproduce(tmp_path / "x", only=["case-88"]), "case-88")


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
    page = Path(__file__).parents[1] / "docs" / "howto" / "twenty_tasks.md"
    first, *tasks = re.findall(r"^```python\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)
    assert first == "import cdpr_drake as cdpr\n"
    assert len(tasks) == 20
    for task in tasks:
        assert len(task.splitlines()) <= 5, task
        assert "import " not in task
        assert set(re.findall(r"cdpr\.(\w+)", task)) <= set(cdpr.__all__)
