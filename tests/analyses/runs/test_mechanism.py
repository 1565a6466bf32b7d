"""Runs of mechanisms: what they reach, both engines, stopping and going on, files, the page."""

import json
import re

import numpy as np
import pytest

from cdpr_drake.analyses.runs.mechanism import MechanismRun
from cdpr_drake.cli.app import main
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.analyses.runs.test_simulate import interrupted
from tests.cli.commands import refuse, run

ARM, BASES = "cable_arm_computed_torque", "mobile_bases_winches"

BETWEEN_STEPS = 1e-3
"""What tensions that are held for a millisecond leave of a motion of 2 rad/s and 15 rad/s^2 [rad];
found 3.8e-4."""

GIVING = 3e-3
"""What bases and platform give under tensions that are not those of the start, up to 50 N on 45 kg
at kp 400 1/s^2: 50 / (45 * 400) = 2.8e-3 [m]; found 1.6e-3."""

ENGINES_APART = 1e-5
"""Of positions by both engines, whose motors and winches are sampled alike [m, rad]: the method is
the same, and steps are cut at other places; found 2e-7."""


def ran(name, *changes):
    return MechanismRun(load_scenario(name, changes)).simulate()


@pytest.fixture(scope="module")
def bases():
    return ran(BASES)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The folder of a command that runs to its end."""
    folder = tmp_path_factory.mktemp("whole") / "out"
    with pytest.raises(SystemExit) as ended:
        main(["simulate", BASES, "--duration", "0.4", "--out", str(folder)])
    assert ended.value.code == 0
    return folder


def test_an_arm_follows_by_computed_torque():
    done = ran(ARM)
    summary = done.as_dict()
    assert done.outcome == Outcome.COMPLETED
    assert summary["rotation_error_rad"]["max"] < BETWEEN_STEPS
    assert summary["infeasible_steps"] == 0
    low, high = summary["tension_limits_n"]
    assert low - 1e-9 <= summary["tension_n"]["min"] < summary["tension_n"]["max"] <= high
    assert summary["beyond_limits_n"] < 1e-9
    distance, angle = done.end_error()
    assert distance == 0.0
    assert angle == summary["rotation_error_rad"]["final"]
    assert np.degrees(angle) < done.scenario.expected.rotation_deg
    np.testing.assert_allclose(done.log["positions"][-1], [0.3, -0.2], atol=BETWEEN_STEPS)
    # What cables carry at the end is what the tension distribution says at rest there.
    follower, context = done.built, done.built.plant.CreateDefaultContext()
    follower.plant.SetPositions(context, [0.3, -0.2])
    J = follower.cables.length_jacobian(context)
    carried = J.T @ done.log["tensions"][-1]
    np.testing.assert_allclose(carried, follower.cables.other_forces(context), atol=1e-5)


def test_bases_drive_and_a_platform_follows_on_winches(bases):
    summary = bases.as_dict()
    assert bases.outcome == Outcome.COMPLETED
    assert summary["position_error_m"]["max"] < GIVING
    assert summary["slack_cable_seconds"] == 0.0
    assert summary["infeasible_steps"] is None
    low, high = summary["tension_limits_n"]
    assert low <= summary["tension_n"]["min"] < summary["tension_n"]["max"] <= high
    assert set(summary["parts"]) == {
        "platform::platform", *(f"base_{k}::{axis}" for k in (1, 2, 3, 4) for axis in "xy")
    }  # fmt: skip
    expected, (distance, angle) = bases.scenario.expected, bases.end_error()
    assert distance < expected.position
    assert np.degrees(angle) < expected.rotation_deg
    # Winches are where they should be at every step: the lengths at the strains of the start.
    log, follower = bases.log, bases.built
    context = follower.plant.CreateDefaultContext()
    lengths = []
    for q in log["wanted_positions"]:
        follower.plant.SetPositions(context, q)
        lengths.append(follower.cables.lengths_and_jacobian(context)[0])
    strains = 1.0 + follower.rest.tensions / follower.cables.routes.ends.stiffness
    np.testing.assert_allclose(log["unstrained_lengths"], lengths / strains, atol=1e-9)
    # At the start nothing moves: motors hold what the rest says.
    held = follower.rest.held[follower.motors()]
    np.testing.assert_allclose(log["motor_forces"][0], held, atol=1e-9)
    assert np.max(np.abs(log["velocities"][0])) == 0.0


def test_a_mechanism_that_shall_stay_stays():
    """At rest on winches with motors that hold: nothing drifts."""
    stays = ["motion.waypoints=[{time: 0.1}]", "duration=0.3"]
    done = ran(BASES, *stays)
    assert done.as_dict()["position_error_m"]["max"] < 1e-10
    with_nobody = ran(ARM, *stays, "control.kind=winches", "control.prestress=40")
    assert "motor_forces" not in with_nobody.log
    assert with_nobody.as_dict()["rotation_error_rad"]["max"] < 1e-10


def test_both_engines_come_to_the_same(bases):
    plant = ran(BASES, "duration=0.5", "integration.engine=plant")
    rows = len(plant.log["time"])
    np.testing.assert_allclose(plant.log["time"], bases.log["time"][:rows])
    for name in ("positions", "unstrained_lengths"):
        there = bases.log[name][:rows]
        np.testing.assert_allclose(plant.log[name], there, atol=ENGINES_APART)


def test_free_bodies_come_first_in_velocities_but_last_among_joints():
    """Names of columns follow the plant's own order, with an arm on a free platform."""
    follower = ran(
        BASES, "mechanism=arm_on_platform", "duration=0.01", "control.prestress=10",
        "motion.waypoints=[{time: 1.0, joints: {elbow: -0.5}}]",
    ).built  # fmt: skip
    plant, names = follower.plant, follower.velocity_names()
    shoulder = plant.GetJointByName("shoulder")
    assert names[shoulder.velocity_start()] == "arm_on_platform::shoulder"
    assert names[0] == "arm_on_platform::platform.wx"
    assert follower.turns().tolist()[:6] == [True] * 3 + [False] * 3
    positions = follower.position_names()
    assert positions[shoulder.position_start()] == "arm_on_platform::shoulder_rad"
    assert positions[:5:4] == ["arm_on_platform::platform.qw", "arm_on_platform::platform.x_m"]
    assert [names[row] for row in follower.motors()] == [
        "arm_on_platform::shoulder", "arm_on_platform::elbow"
    ]  # fmt: skip


def test_the_command_goes_on_in_its_folder(whole, capsys, here):
    """The folder's scenario names mechanism and bodies elsewhere than the command's scenario."""
    scenario = load_scenario(BASES, ["duration=0.4"])
    interrupted(scenario, here / "out", 0.15)
    assert json.loads((here / "out" / "summary.json").read_text())["sim_time_s"] < 0.3
    changed = ("--set", "control.prestress=30")
    words = refuse(capsys, "simulate", BASES, "--duration", "0.4", "--out", "out", *changed)
    assert "scenario.control.prestress is 60.0 there, 30.0 here" in words
    assert run(capsys, "simulate", BASES, "--duration", "0.4", "--out", "out")[0] == 0
    for name in ("log.npz", "log.csv", "scenario.yaml", "mechanism.yaml"):
        assert (here / "out" / name).read_bytes() == (whole / name).read_bytes(), name


def test_what_speaks_against_a_run_is_told_and_one_of_too_long_steps_diverges():
    coarse = load_scenario(BASES, ["integration.max_step=0.05", "control.rate=20", "duration=1"])
    (warning,) = [one for one in MechanismRun(coarse).check() if "max_step" in one]
    assert "accepted: at most 0.0036 s" in warning
    done = MechanismRun(coarse).simulate()
    assert done.outcome == Outcome.DIVERGED
    summary = done.as_dict()
    json.dumps(summary, allow_nan=False)
    assert done.facts(summary)
    assert MechanismRun(load_scenario(BASES)).check() == []
    (warning,) = MechanismRun(load_scenario(ARM, ["duration=1.5"])).check()
    assert "the last of motion.waypoints is at 2 s" in warning


def test_command_writes_a_folder_that_runs_again(whole):
    summary = json.loads((whole / "summary.json").read_text())
    assert (summary["kind"], summary["mechanism"]) == ("mechanism", "mobile_bases")
    names = {path.name for path in whole.iterdir()}
    figures = {f"{name}.png" for name in
               ("error", "positions", "tensions", "cable_lengths", "motor_forces")}  # fmt: skip
    assert figures | {"log.csv", "log.npz", "mechanism.yaml", "scenario.yaml", "summary.json",
                      "replay.html"} <= names  # fmt: skip
    head = (whole / "log.csv").read_text().splitlines()[0].split(",")
    assert {"positions.base_1::x_m", "way_off.platform::platform.wx_rad", "tensions.C1_n",
            "velocities.base_2::y_m_s", "motor_forces.base_4::y_n"} <= set(head)  # fmt: skip
    again = load_scenario(str(whole / "scenario.yaml"))
    assert again.mechanism == str(whole / "mechanism.yaml")
    page = (whole / "replay.html").read_text()
    data = json.loads(re.search(r'id="cdpr-data">(.*?)</script>', page).group(1))
    assert data["names"] == [f"C{k}" for k in range(1, 9)]
    assert {"time", "tensions", "slack", "places"} == set(data["frames"])


def test_the_figure_of_what_computed_torque_could_not_do():
    """Limits that the motion does not keep, while the places where it rests do."""
    way = "motion.waypoints=[{time: 0.15, joints: {elbow: -0.4}}]"
    done = ran(ARM, way, "duration=0.3", "control.limits=[2, 40]")
    summary = done.as_dict()
    assert summary["infeasible_steps"] > 0
    assert "motor_forces" not in done.figures()
    assert done.plot("error").axes[0].get_legend().get_texts()[-1].get_text().startswith("no tens")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("simulate", ARM, "--meshcat"), "--meshcat: found with the kind mechanism"),
        (("simulate", ARM, "--seeds", "0:2"), "accepted: visual servos"),
        (("simulate", ARM, "--video"), "--video: found with a mechanism; accepted: with a visual"),
        (("serve", ARM), "kind: found mechanism; accepted by cdpr serve"),
    ],
)
def test_what_mechanisms_have_not_is_refused(capsys, here, arguments, words):
    assert words in refuse(capsys, *arguments)
    assert list(here.iterdir()) == []


def test_check_and_new_know_the_kind(capsys, here):
    assert set(scenario_names("mechanism")) == {ARM, BASES}
    assert run(capsys, "new", "scenario", "mine", "--from", BASES)[0] == 0
    code, out, _ = run(capsys, "check", "mine.yaml")
    assert (code, out.strip()) == (0, "mine.yaml: valid scenario")
    assert "# " in (here / "mine.yaml").read_text()
