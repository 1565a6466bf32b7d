"""`cdpr simulate`, `cdpr finish` and the verbs: what they write and say, and how they go on."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame import words as argument_words
from cdpr_drake.analyses.frame.follow import Follow
from cdpr_drake.analyses.runs import log, simulate
from cdpr_drake.analyses.runs.run import Run
from cdpr_drake.analyses.runs.servo_figures import error_figure
from cdpr_drake.errors import CdprError, ScenarioError
from cdpr_drake.kernel_cache.kernel_list import needed_kernels
from cdpr_drake.models import rendered_camera
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from tests.cli.commands import answer, ended, killed_after, refuse, run, told
from tests.cli.conftest import only
from tests.newcomer import OWN_ROBOT
from tests.record_kernels import kept_kernels

pytestmark = pytest.mark.usefixtures("here")

ROOT = Path(__file__).parents[3]
SHORT = ("simulate", "--camera", "projected", "--duration", "0.1")
SERVO = ("simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.3")
TENSIONS = ("simulate", "acrobot_computed_torque", "--set", "integration.engine=plant",
            "--duration", "0.3")  # fmt: skip


def interrupted(scenario, folder, sim_time):
    """A run that somebody stops at a simulated time [s]."""
    last = [0.0]
    follow = Follow(lambda now: last.append(now.done), lambda: last[-1] >= sim_time)
    run = cdpr.simulate(scenario, folder=folder, follow=follow)
    assert (run.outcome, run.exit_code) == (Outcome.INTERRUPTED, 130)
    return run


def same_files(one, other):
    """Asserts that two runs have the same files, but for what tells how long they took."""
    names = sorted(path.name for path in one.iterdir() if path.name[0] != ".")
    assert names == sorted(path.name for path in other.iterdir() if path.name[0] != ".")
    summaries = []
    for folder in (one, other):
        summary = json.loads((folder / "summary.json").read_text())
        assert summary.pop("wall_time_s") > 0.0
        summaries.append({**summary, "realtime_factor": None})
    assert summaries[0] == summaries[1]
    for name in {*names} - {"summary.json"}:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name


@pytest.mark.usefixtures("without_pictures")
def test_it_writes_a_folder_prints_json_numbers_its_folders_and_takes_overrides(capsys, here):
    summary = told(capsys, *SHORT, "--out", "there", "--seed", "4")
    assert (summary["seed"], summary["outcome"]) == (4, "timeout")
    assert json.loads((here / "there" / "summary.json").read_text()) == summary
    # The end of a chosen duration is no timeout.
    assert "acrobot_pbvs_taut: ended at 0.1 s, as asked" in answer(capsys, *SHORT)
    goal = ("--set", "desired.position=[0.1, 0, 0.09]")
    code, _, err = run(capsys, *SHORT, "--set", "controller.lambda_0=1.25", *goal)
    assert code == 0
    assert "warning: acrobot_pbvs_taut: desired: the camera does not see all of the target" in err
    assert sorted(os.listdir("runs")) == ["acrobot_pbvs_taut", "acrobot_pbvs_taut-2"]
    assert "lambda_0: 1.25" in (here / "runs/acrobot_pbvs_taut-2/scenario.yaml").read_text()
    assert sorted(os.listdir(here)) == ["runs", "there"]


def test_arguments_of_the_verb_are_settings_of_the_scenario():
    run = cdpr.simulate(
        "acrobot_pbvs", ["controller.lambda_0=1.25"], camera="projected", duration=0.1, seed=7,
        log_rate=20,
    )  # fmt: skip
    scenario = run.scenario
    assert (scenario.camera.kind, scenario.duration, scenario.seed) == ("projected", 0.1, 7)
    assert (scenario.log_rate, scenario.controller.lambda_0) == (20.0, 1.25)
    assert run.folder is None
    assert repr(run).startswith("acrobot_pbvs: ended at 0.1 s, as asked")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: cdpr.simulate(cdpr.load_robot("planar")), "found the robot planar; accepted: a"),
        (lambda: cdpr.simulate(load_scenario("planar_pbvs"), duration=1.0), "with overrides"),
        (lambda: cdpr.simulate("planar_computed_torque", camera="projected"), "has no camera"),
        (lambda: cdpr.simulate("planar_computed_torque", video=True), "video: found with a tens"),
        (lambda: cdpr.simulate("cable_arm_computed_torque", meshcat=True), "replay.html shows"),
        (lambda: cdpr.simulate("planar_pbvs", host="*"), "host, port: found alone"),
        (lambda: cdpr.simulate("planar_pbvs", log_formats=["xls"]), "log_formats: found 'xls'"),
        (lambda: cdpr.simulate("planar_pbsv"), "planar_pbvs"),
        (lambda: cdpr.simulate("planar_pbvs", ["remote.place=servo"]), "accepted: cdpr serve"),
        (lambda: cdpr.finish_run("nowhere"), "nowhere: found no log of an interrupted run"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_in_one_line(call, words, here):
    with pytest.raises(CdprError) as problem:
        call()
    assert words in str(problem.value)
    assert "\n" not in str(problem.value)
    assert not any(here.iterdir())


def test_a_robot_is_refused_with_the_commands_that_take_it(capsys, here):
    shutil.copy(robot_file("planar"), here / "hall.yaml")
    said = refuse(capsys, "simulate", "hall.yaml")
    assert "found a robot; use a command that takes one, such as cdpr tension or cdpr view" in said


def test_formats_alone_and_together_and_what_is_accepted(capsys):
    for words, formats in (("png,png", ["png"]), ("svg, PDF", ["svg", "pdf"])):
        assert list(argument_words.formats(words)) == formats
    for words in ("", "jpg", "png,", "png pdf", "../png", "png,eps"):
        said = refuse(capsys, "simulate", f"--figure-format={words}")
        assert f"--figure-format: found {words!r}; accepted: png, pdf, svg" in said


def test_a_figure_that_fails_costs_no_other(capsys, here, monkeypatch):
    def broken(run):
        raise RuntimeError("no font")

    words = (*SHORT, "--out", "out", "--json", "--figure-format", "pdf,svg")
    drawn = only("error.pdf", "error.svg", "tensions.pdf", "tensions.svg", ".png", "replay.html")
    with drawn, monkeypatch.context() as patch:
        patch.setattr(f"{error_figure.__module__}.error_figure", broken)
        code, out, err = run(capsys, *words)
    assert code == 3
    assert "error.pdf: not written: no font" in err
    assert json.loads(out)["outcome"] == "timeout"
    names = set(os.listdir("out"))
    drawn = {name for name in names if name.endswith((".png", ".pdf", ".svg", ".html"))}
    assert drawn == {"tensions.pdf", "tensions.svg", "replay.html"}
    assert {"summary.json", "log.npz"} <= names
    with only("error.svg", "replay.html"):
        assert ended(*words) == 0  # the same command draws what is missing
    assert (here / "out" / "error.svg").is_file()


def test_a_broken_graphics_driver_is_one_line(capsys, here, monkeypatch):
    """Without a vendor's library VTK ends its process by SIGSEGV at the first image."""
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", os.devnull)
    state = rendered_camera._State(has_renderer=True)  # so that a new process tries it
    monkeypatch.setattr(rendered_camera, "_state", state)
    said = refuse(capsys, "simulate", "--duration", "0.1", "--out", "there")
    assert "SIGSEGV" in said
    assert "--camera projected" in said
    assert not any(here.iterdir())


@pytest.mark.usefixtures("without_pictures")
def test_a_timeout_says_limits_slack_cables_and_keys(capsys, here):
    loop = ("--set", "integration.engine=compiled", "--set", "integration.loop=compiled")
    out = " ".join(answer(capsys, *SERVO[:4], "--set", "duration=0.6", *loop).split())
    summary = json.loads((here / "runs" / "acrobot_pbvs" / "summary.json").read_text())
    assert (summary["outcome"], summary["loop"]) == ("timeout", "compiled")
    assert summary["slack_cable_seconds"] > 0.0
    for words in (
        "expected converged", "duration = 0.6 s was over", "stop.rotation_deg = 0.5 deg",
        "cables were slack: C", "to change: ", "initial_pose", "tension_management",
    ):  # fmt: skip
        assert words in summary["message"]
        assert words in out


TRACKING = """\
kind: tension_control
name: tracking
robot: bay.yaml
duration: 0.2
trajectory: {start: {position: [0.0, 0.0, 1.1]},
  stretches: [{pose: {position: [0.01, 0.0, 1.1]}, duration: 2.0}]}
controller: {rate: 100.0, stiffness: 100.0, damping: 20.0}
distribution: {limits: LIMITS}
"""


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(
    ("limits", "used", "remarks"),
    [
        ("[1.0, 60.0]", [1.0, 60.0],
         ["distribution.limits = 1 to 60 N replace tension_bounds of bay, 4 to 350 N; null takes "
          "those"]),
        ("null", [4.0, 350.0], []),
    ],
)  # fmt: skip
def test_limits_that_replace_those_of_the_robot_are_said(limits, used, remarks, capsys, here):
    (here / "bay.yaml").write_text(OWN_ROBOT.read_text())
    (here / "tracking.yaml").write_text(TRACKING.replace("LIMITS", limits))
    code, out, err = run(capsys, "simulate", "tracking.yaml", "--json")
    summary = json.loads(out)
    assert (code, summary["tension_limits_n"], summary["remarks"]) == (0, used, remarks)
    assert ("replace tension_bounds" in err) == bool(remarks)
    assert used[0] <= summary["tension_n"]["min"] <= summary["tension_n"]["max"] <= used[1]


# Interrupted runs.

ENDLESS = ("simulate", "--camera", "projected", "--out", "out", "--duration", "100000",
           "--set", "stop.hold=100000")  # fmt: skip

MARKED = """
import json, pathlib, sys
from numba.core.dispatcher import Dispatcher
sys.path.append(sys.argv[1])
from tests.record_kernels import recorded
asked = recorded(Dispatcher)
from cdpr_drake.analyses.runs.log import Recorder
from cdpr_drake.cli.app import main
record = Recorder.__call__

def marked(self):
    pathlib.Path("simulates").touch()
    record(self)

Recorder.__call__ = marked
sys.argv[:2] = ["cdpr"]
try:
    main()
finally:
    pathlib.Path("simulates").write_text(json.dumps(asked))
"""
"""The command, which makes a file when it has simulated something; in the end with the kernels that
it has asked for."""


def test_sigterm_keeps_what_was_simulated(here):
    """As batch systems and containers stop a program."""
    words = [sys.executable, "-c", MARKED, str(ROOT), *ENDLESS]
    words += ["--set", "integration.engine=plant"]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdout=pipe, stderr=pipe, text=True) as process:
        while not (here / "simulates").exists():
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate()
    assert process.returncode == 130
    assert "the same command goes on" in err
    assert json.loads((here / "out" / "summary.json").read_text())["outcome"] == "interrupted"
    assert (here / "out" / log.PARTS / log.CHECKPOINT).is_file()
    assert sorted(os.listdir(here)) == ["out", "simulates"]
    asked = kept_kernels(json.loads((here / "simulates").read_text()))
    listed = {(k.name, k.signature) for k in needed_kernels([DEFAULT_SCENARIO])}
    assert asked
    assert asked <= listed, "python -m tests.record_kernels makes a new list"


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("words", [SERVO, TENSIONS], ids=["servo", "tensions"])
def test_the_same_command_goes_on_from_a_kill_an_interruption_and_half_drawn_figures(
    words, here, capsys, monkeypatch
):
    assert ended(*words, "--out", "whole") == 0
    setup = (
        "import cdpr_drake.analyses.runs.log as log\nlog.CHECKPOINT_WAIT, log.MOST_ROWS = 0.0, 1"
    )
    program = killed_after(2, "cdpr_drake.analyses.runs.log.DiskLog.append", setup)
    killed = subprocess.run([sys.executable, "-c", program, *words, "--out", "out"], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert (here / "out" / log.PARTS / log.CHECKPOINT).is_file()
    asked = refuse(capsys, *words, "--seed", "5", "--out", "out")
    assert "scenario.seed is 0 there, 5 here; name another folder or add --overwrite" in asked
    assert ended(*words, "--out", "out") == 0
    same_files(here / "whole", here / "out")

    class EndedError(BaseException):
        """The process ends while figures are drawn."""

    def end(*_):
        raise EndedError

    with monkeypatch.context() as patch:
        patch.setattr("cdpr_drake.analyses.runs.run.figure_writers", end)
        with pytest.raises(EndedError):
            ended(*words, "--out", "drawn")
    assert (here / "drawn" / "summary.json").is_file()
    assert ended(*words, "--out", "drawn") == 0
    same_files(here / "whole", here / "drawn")


KINDS = {
    "servo": SERVO, "tensions": TENSIONS,
    "pick and place": ("simulate", "acrobot_pick_and_place", "--camera", "projected",
                       "--duration", "0.2"),
    "mechanism": ("simulate", "cable_arm_computed_torque", "--duration", "0.1"),
}  # fmt: skip


@pytest.mark.parametrize("words", KINDS.values(), ids=KINDS)
def test_a_complete_run_is_read_again_and_what_is_missing_is_drawn(
    words, here, capsys, monkeypatch
):
    with only("replay.html"):
        numbers = told(capsys, *words, "--out", "whole")
    with only("none"):
        told(capsys, *words, "--out", "out")
    monkeypatch.setattr(Run, "simulate", None)  # nothing is simulated
    before = (here / "out" / "log.npz").stat()
    with only("replay.html"):
        code, out, err = run(capsys, *words, "--out", "out", "--json")
    assert (code, "reused the run of out" in err) == (0, True)
    again = json.loads(out)
    for summary in (numbers, again):
        del summary["wall_time_s"], summary["realtime_factor"]
    assert again == numbers
    same_files(here / "whole", here / "out")
    assert (here / "out" / "log.npz").stat() == before
    drawn = (here / "out" / "replay.html").stat()
    with only(".mat", "replay.html"):
        table = answer(capsys, *words, "--out", "out", "--log-format", "mat")
        assert table == answer(capsys, *words, "--out", "out", "--plot", "figure.svg")
    assert (here / "out" / "replay.html").stat() == drawn
    assert (here / "out" / "log.mat").is_file()
    assert (here / "figure.svg").is_file()


@pytest.mark.usefixtures("without_pictures")
def test_a_run_without_all_its_files_is_simulated_again(here):
    assert ended(*SERVO, "--out", "whole") == 0
    for name in ("log.csv", "log.npz", "summary.json"):
        shutil.copytree(here / "whole", here / "out")
        (here / "out" / name).unlink()
        assert ended(*SERVO, "--out", "out") == 0
        same_files(here / "whole", here / "out")
        shutil.rmtree(here / "out")


@pytest.mark.usefixtures("without_pictures")
def test_an_interrupted_run_is_found_without_out_and_is_finished_by_its_name(here, capsys):
    scenario = load_scenario("planar_pbvs", ["camera.kind=projected", "duration=0.4"])
    base, words = here / "runs" / "planar_pbvs", ("planar_pbvs", "--camera", "projected")
    run = interrupted(scenario, base, 0.2)
    assert run.notes() == ["Interrupted at 0.2 s of simulated time; the same command goes on"]
    shutil.copytree(base, here / "left")
    answer(capsys, "simulate", *words, "--duration", "0.4")
    assert os.listdir(here / "runs") == ["planar_pbvs"]
    summary = told(capsys, "finish", "left")
    assert (summary["outcome"], summary["sim_time_s"]) == ("interrupted", pytest.approx(0.2))
    assert summary["message"] == "the program ended before the run did"
    with np.load(here / "left" / "log.npz") as part, np.load(base / "log.npz") as whole:
        for name in whole:
            np.testing.assert_array_equal(part[name], whole[name][: len(part[name])])
    assert not (here / "left" / log.PARTS).exists()
    assert "left: found no log of an interrupted run" in refuse(capsys, "finish", "left")
    said = refuse(capsys, "simulate", *words, "--duration", "0.4", "--out", "left")
    assert "left: holds other results: interrupted_at_s is 0.2 there, not here; name" in said


@pytest.mark.usefixtures("without_pictures")
def test_a_full_disk_keeps_what_was_simulated(here, capsys, monkeypatch):
    append = log.DiskLog.append

    def full(self, rows):
        if self.rows >= 5:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        append(self, rows)

    words = (*SERVO, "--out", "out")
    with monkeypatch.context() as patch:
        patch.setattr(log, "MOST_ROWS", 1)
        patch.setattr(log.DiskLog, "append", full)
        said = refuse(capsys, *words)
    assert "No space left on device; what was finished is kept, and the same command" in said
    assert len(log.DiskLog(here / "out" / log.PARTS)["time"]) >= 5
    assert ended(*words) == 0
    assert not (here / "out" / log.PARTS).exists()


@pytest.mark.usefixtures("without_pictures")
def test_a_run_holds_no_log_open_once_it_is_written(here):
    result = cdpr.simulate(DEFAULT_SCENARIO, camera="projected", duration=0.1, folder="out")
    held = [path.resolve().name for path in Path("/proc/self/fd").iterdir()]
    assert result.log["time"][-1] == pytest.approx(0.1)
    assert "log.npz" not in held


def test_warnings_go_to_the_log_if_nobody_follows_and_else_to_who_does(caplog):
    unseen = ["camera.kind=projected", "desired.position=[1.0, 0.0, 0.3]"]
    cdpr.simulate("planar_pbvs", unseen, duration=0.05)
    told = [each.getMessage() for each in caplog.records if each.levelname == "WARNING"]
    assert ["does not see" in told[0], "outside the frame" in told[1], len(told)] == [True, True, 2]
    caplog.clear()
    lines = []
    cdpr.simulate("planar_pbvs", unseen, duration=0.05, follow=Follow(say=lines.append))
    assert [line for line in lines if line.startswith("warning: ")] == [
        f"warning: {words}" for words in told
    ]
    assert caplog.records == []


def test_kinds_are_those_of_scenario_files():
    assert set(simulate.KINDS) == {"visual_servo", "tension_control", "pick_and_place", "mechanism"}
    for kind in simulate.KINDS.values():
        other = "planar_pbvs" if kind.kind != "visual_servo" else "planar_computed_torque"
        with pytest.raises(ScenarioError, match="simulate runs all kinds"):
            kind(load_scenario(other))
