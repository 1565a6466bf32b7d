"""`cdpr simulate`: what it writes and says, alone, over seeds, and for reactions to a broken cable.

That runs are finished and go on: `test_unfinished_runs`.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cdpr_drake.cli.simulate import seeds_of

import cdpr_drake as cdpr
from cdpr_drake.analyses.frame import words as argument_words
from cdpr_drake.analyses.simulation.log_keeper import LogKeeper
from cdpr_drake.kernel_cache.kernel_list import needed_kernels
from cdpr_drake.models import rendered_camera
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from tests.cli.commands import STORE, answer, ended, killed_after, refuse, run, told
from tests.cli.conftest import only
from tests.newcomer import OWN_ROBOT
from tests.record_kernels import kept_kernels

pytestmark = pytest.mark.usefixtures("here")

ROOT = Path(__file__).parents[2]
SHORT = ("simulate", "--camera", "projected", "--duration", "0.1")
COMPILED = ("--set", "integration.engine=compiled", "--set", "integration.loop=compiled")


@pytest.mark.usefixtures("without_pictures")
def test_it_writes_a_folder_and_prints_json(capsys, here):
    summary = told(capsys, *SHORT, "--out", "there", "--seed", "4")
    assert (summary["seed"], summary["outcome"]) == (4, "timeout")
    assert json.loads((here / "there" / "summary.json").read_text()) == summary
    assert os.listdir(here) == ["there"]


@pytest.mark.usefixtures("without_pictures")
def test_without_out_it_numbers_its_folders_and_takes_overrides(capsys, here):
    # The end of a duration that was asked for is no timeout.
    assert "acrobot_pbvs_taut: ended at 0.1 s, as asked" in answer(capsys, *SHORT)
    goal = ("--set", "desired.position=[0.1, 0, 0.09]")
    code, _, err = run(capsys, *SHORT, "--set", "controller.lambda_0=1.25", *goal)
    assert code == 0
    assert "warning: acrobot_pbvs_taut: desired: the camera does not see all of the target" in err
    assert sorted(os.listdir("runs")) == ["acrobot_pbvs_taut", "acrobot_pbvs_taut-2"]
    text = (here / "runs" / "acrobot_pbvs_taut-2" / "scenario.yaml").read_text()
    assert "lambda_0: 1.25" in text


def test_figures_have_the_formats_asked_for_and_one_that_fails_costs_no_other(
    capsys, here, monkeypatch
):
    def broken(result):
        raise RuntimeError("no font")

    monkeypatch.setattr("cdpr_drake.analyses.simulation.run_figures.error_figure", broken)
    words = (*SHORT, "--out", "out", "--json", "--figure-format", "pdf,svg")
    with only("error.pdf", "error.svg", "tensions.pdf", "tensions.svg", ".png", "replay.html"):
        code, out, err = run(capsys, *words)
    assert code == 3
    assert "error.pdf: not written: no font" in err
    assert json.loads(out)["outcome"] == "timeout"
    names = os.listdir("out")
    drawn = {name for name in names if name.endswith((".png", ".pdf", ".svg", ".html"))}
    assert drawn == {"tensions.pdf", "tensions.svg", "replay.html"}
    assert {"summary.json", "log.npz"} <= {*names}


def test_formats_alone_and_together_and_what_is_accepted(capsys):
    for words, formats in (
        ("png", ("png",)), ("pdf,svg", ("pdf", "svg")), ("svg, PDF", ("svg", "pdf")),
        ("png,png", ("png",)),
    ):  # fmt: skip
        assert tuple(argument_words.formats(words)) == formats
    for words in ("", "jpg", "png,", "png pdf", "../png", "png,eps"):
        said = refuse(capsys, "simulate", f"--figure-format={words}")
        assert f"--figure-format: found {words!r}; accepted: png, pdf, svg" in said


def test_a_broken_graphics_driver_is_one_line(capsys, here, monkeypatch):
    """Without a vendor's library VTK ends its process by SIGSEGV at the first image."""
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", os.devnull)
    state = rendered_camera._State(has_renderer=True)  # so that a new process tries it
    monkeypatch.setattr(rendered_camera, "_state", state)
    said = refuse(capsys, "simulate", "--duration", "0.1", "--out", "there")
    assert "SIGSEGV" in said
    assert "--camera projected" in said
    assert not any(here.iterdir())


ENDLESS = ("simulate", "--camera", "projected", "--out", "out", "--duration", "100000",
           "--set", "stop.hold=100000")  # fmt: skip

MARKED = """
import json, pathlib, sys
from numba.core.dispatcher import Dispatcher
sys.path.append(sys.argv[1])
from tests.record_kernels import recorded
asked = recorded(Dispatcher)
from cdpr_drake.analyses.simulation.log_keeper import LogKeeper
from cdpr_drake.cli.app import main
keep = LogKeeper.__call__

def marked(self):
    pathlib.Path("simulates").touch()
    keep(self)

LogKeeper.__call__ = marked
sys.argv[:2] = ["cdpr"]
try:
    main()
finally:
    pathlib.Path("simulates").write_text(json.dumps(asked))
"""
"""The command, which leaves a file when it has simulated something, however long that takes; in the
end with the kernels that it has asked for."""


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
        process.communicate()
    assert process.returncode == 130
    assert json.loads((here / "out" / "summary.json").read_text())["outcome"] == "interrupted"
    assert sorted(os.listdir(here)) == ["out", "simulates"]
    asked = kept_kernels(json.loads((here / "simulates").read_text()))
    listed = {(k.name, k.signature) for k in needed_kernels([DEFAULT_SCENARIO])}
    assert asked
    assert asked <= listed, "python -m tests.record_kernels makes a new list"


@pytest.mark.usefixtures("without_pictures")
def test_ctrl_c_keeps_what_was_simulated(capsys, here, monkeypatch):
    keep, times = LogKeeper.__call__, iter([signal.SIGINT])

    def interrupted(self):
        keep(self)
        if number := next(times, None):
            signal.raise_signal(number)

    monkeypatch.setattr(LogKeeper, "__call__", interrupted)
    code, _, err = run(capsys, *ENDLESS)
    assert code == 130
    assert "Interrupted at" in err
    summary = json.loads((here / "out" / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"
    assert summary["sim_time_s"] > 0.0


def test_a_timeout_says_limits_slack_cables_and_keys(capsys, here):
    words = ("simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.6", *COMPILED)
    code, out, _ = run(capsys, *words, "--out", "out")
    assert code == 0
    told = json.loads((here / "out" / "summary.json").read_text())
    assert told["outcome"] == "timeout"
    for words in (
        "expected converged", "duration = 0.6 s was over", "stop.position = 0.3 mm",
        "stop.rotation_deg = 0.5 deg", "cables were slack: C", "to change: ", "duration (longer)",
        "initial_pose", "tension_management",
    ):  # fmt: skip
        assert words in told["message"]
    # What it says of cables is what the summary says.
    assert told["slack_cable_seconds"] > 0.0
    said = " ".join(out.replace("│", " ").split())
    assert "stop.position = 0.3 mm" in said
    assert "cables were slack" in said


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
def test_limits_that_replace_those_of_the_robot_are_said(capsys, here):
    (here / "bay.yaml").write_text(OWN_ROBOT.read_text())
    for limits, used, said in (
        ("[1.0, 60.0]", [1.0, 60.0],
         "distribution.limits = 1 to 60 N replace tension_bounds of bay, 4 to 350 N"),
        ("[4.0, 350.0]", [4.0, 350.0], ""),
        ("null", [4.0, 350.0], ""),
    ):  # fmt: skip
        (here / "tracking.yaml").write_text(TRACKING.replace("LIMITS", limits))
        asked = ("simulate", "tracking.yaml", "--json", "--out", "out", "--overwrite")
        code, out, err = run(capsys, *asked)
        found = json.loads(out)
        assert (code, found["tension_limits_n"]) == (0, used)
        assert bool(found["remarks"]) == bool(said)
        assert all(said in words for words in found["remarks"])
        assert ("replace tension_bounds" in err) == bool(said)
        assert used[0] <= found["tension_n"]["min"] <= found["tension_n"]["max"] <= used[1]


def test_seeds_are_spans_and_lists(capsys):
    words = {"0:3": [0, 1, 2], "5:6": [5], "4": [4], "3,5,8": [3, 5, 8]}
    assert {each: seeds_of(each) for each in words} == words
    for each in (
        "", "3:3", "5:2", "1:2:3", "-1:2", "1,1", "a", "1.5", "0:9999999999", "9999999999",
    ):  # fmt: skip
        assert "accepted: first:end" in refuse(capsys, "simulate", f"--seeds={each}")


MANY = ("simulate", "--camera", "projected", "--workers", "1", "--seeds")


def test_runs_over_seeds_are_a_folder_and_finished_ones_are_found_again(capsys, here):
    def repeat(seeds, duration="0.1", *more):
        words = (*MANY, seeds, "--json", "--duration", duration, *more)
        code, out, err = run(capsys, *words)
        return code, json.loads(out) if out else None, err

    code, summary, said = repeat("0:2")
    assert code == 0
    assert said.splitlines() == [
        f"{DEFAULT_SCENARIO}: by the compiled loop (its events in Python, since its tensions are "
        "managed), as the run is repeated; else with --set integration.loop=diagram"
    ]
    assert (summary["seeds"], summary["outcomes"]) == ([0, 1], {"timeout": 2})
    assert [one["seed"] for one in summary["runs"]] == [0, 1]
    assert {(one["engine"], one["loop"]) for one in summary["runs"]} == {("compiled", "compiled")}
    (folder,) = (here / "runs").iterdir()
    assert folder.name.startswith("acrobot_pbvs_taut-")
    assert (folder / "runs.csv").is_file()

    into = ("--out", str(folder))
    _, again, said = repeat("0:2", "0.1", *into)
    assert "complete already" in said
    assert again["runs"] == summary["runs"]  # times included: nothing was computed
    _, more, said = repeat("1:4", "0.1", *into)
    assert "1 of 3 runs were there already" in said
    assert f"Continuing in {folder}" in said
    assert [one["seed"] for one in more["runs"]] == [1, 2, 3]
    assert more["runs"][0] == summary["runs"][1]
    code, _, said = repeat("0:2", "0.2", *into)
    assert code == 2
    assert "scenario.duration is 0.1 there, 0.2 here" in said
    assert repeat("0:1", "0.2", *into, "--overwrite")[0] == 0
    assert os.listdir(here) == ["runs"]


def test_another_robot_in_the_same_file_is_another_question(capsys, here):
    words = robot_file("acrobot_small").read_text()
    (here / "mine.yaml").write_text(words)
    arguments = (*MANY, "0", "--duration", "0.1", "--out", "out", "--set", "robot=mine.yaml")
    assert ended(*arguments) == 0
    mass = re.search(r"mass: ([\d.]+)", words)
    (here / "mine.yaml").write_text(words.replace(mass[0], f"mass: {1.01 * float(mass[1])}"))
    code, _, err = run(capsys, *arguments)
    assert (code, "results of other arguments: robot." in err) == (2, True)


def test_a_killed_repetition_continues(capsys, here):
    """Whatever ends the program, seeds that were finished are not done again."""
    options = (*MANY, "0:4", "--duration", "0.1", "--out", "out", "--json")
    program = killed_after(2, STORE)
    done = subprocess.run([sys.executable, "-c", program, *options], check=False)
    assert done.returncode == -signal.SIGKILL
    kept = {path: path.stat().st_mtime_ns for path in here.glob("out/chunks/seed-*.npz")}
    assert len(kept) == 2
    code, out, err = run(capsys, *options)
    assert code == 0
    assert "Continuing in out: 2 of 4 runs were there already" in err
    assert len(json.loads(out)["runs"]) == 4
    assert {path: path.stat().st_mtime_ns for path in kept} == kept


ENGINE = "integration.engine=compiled"


def test_reactions_are_compared_as_the_call_does(capsys, here):
    found = told(
        capsys, "simulate", "acrobot_broken_redistributed", "--compare-reactions", "5",
        "--break-time", "0.3", "--after", "0.3", "--reactions", "none,stop", "--set", ENGINE,
        "--out", "found",
    )  # fmt: skip
    same = cdpr.compare_reactions(
        cable=5, time=0.3, after=0.3, reactions=("none", "stop"), overrides=[ENGINE]
    )
    assert found == same.as_dict()
    assert json.loads((here / "found" / "results.json").read_text()) == found
    assert (here / "found" / "reactions.png").is_file()
