"""`cdpr stability`: what it prints and writes, continues and refuses."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from importlib import import_module
from typing import Annotated, get_origin, get_type_hints

import pytest
import yaml

from cdpr_drake.analyses.workspaces.stability_defaults import workspace_defaults
from cdpr_drake.analyses.workspaces.stability_figures import curves, planes_figure
from cdpr_drake.analyses.workspaces.stability_question import make_question
from cdpr_drake.analyses.workspaces.stability_results import CHUNK_POSES, load_workspaces
from cdpr_drake.cli.app import main
from cdpr_drake.cli.grid_options import parse_grid
from cdpr_drake.models.robot_loader import load_robot, robot_file
from tests.cli.killed import killed_after
from tests.messages import messages, printed
from tests.models.representative_robots import REPRESENTATIVE_ROBOTS

SMALL = ["--verdict", "sampled", "--draws", "5", "--workers", "1"]
TINY = [*SMALL, "--grid", "3,3,3"]


def run(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(["stability", *arguments])
    out, err = printed(capsys)
    return ended.value.code, out, err


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_writes_a_folder_and_prints_json(capsys, tmp_path):
    code, out, _ = run(
        capsys, "acrobot_small", *TINY, "--scheme", "ibvs", "--vary", "r_A=0.005,0.05",
        "--orientation", "0,0,0", "--orientation", "0,0,20", "--out", "o", "--json",
    )  # fmt: skip
    assert code == 0
    found = json.loads(out)
    assert json.loads((tmp_path / "o" / "results.json").read_text()) == found
    assert [row["bounds"] for row in found["workspaces"]] == ["baseline", "r_A=0.005", "r_A=0.05"]
    assert found["workspaces"][0]["Z"]["of_poses"] == 2 * 27
    assert found["grid"]["points"] == [3, 3, 3]
    assert load_workspaces(tmp_path / "o").as_dict() == found
    assert {"planes.png", "solids.png", "volumes.png", "workspace.html"} <= {
        path.name for path in (tmp_path / "o").iterdir()
    }


@pytest.mark.usefixtures("no_room_for_pictures")
def test_pictures_that_fail_cost_nothing_else(capsys, tmp_path):
    code, out, err = run(capsys, "acrobot_small", *TINY, "--out", "o", "--json")
    assert code == 3
    for name in ("planes.png", "solids.png", "workspace.html"):
        assert f"o/{name}: not written: [Errno 28]" in err
    assert json.loads(out) == json.loads((tmp_path / "o" / "results.json").read_text())
    assert {path.name for path in (tmp_path / "o").iterdir() if path.is_file()} == {
        ".cdpr_drake.json", "arguments.json", "results.json", "workspace.npz",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ([], "L_s with [s_t]x, exact"),
        (["--printed-matrix"], "L_s with [e_t]x, as (1.47) of the servoing thesis prints it"),
        (["--scenario", "acrobot_pbvs"], "L_s with [s_t]x, exact"),
        (["--scheme", "ibvs"], None),
    ],
)
def test_says_which_interaction_matrix_it_took(capsys, tmp_path, more, words):
    code, out, _ = run(capsys, "acrobot_large", *TINY, *more, "--out", "o")
    assert code == 0
    found = json.loads((tmp_path / "o" / "results.json").read_text())
    assert found["interaction_matrix"] == words
    assert ("interaction matrix:" in out) == (words is not None)
    title = planes_figure(load_workspaces(tmp_path / "o")).get_suptitle()
    assert ("L_s" in title) == (words is not None)
    if words is not None:
        assert f"interaction matrix: {words}" in out
        # Its formulas are mathtext: $L_s$ with $[e_t]_\\times$.
        assert words in title.replace("$", "").replace("_\\times", "x")


def test_the_same_arguments_find_their_folder_again(capsys, tmp_path):
    code, out, err = run(capsys, "planar", *SMALL, "--grid", "5,5,1")
    assert code == 0
    assert "results: stability/planar-pbvs-sampled-" in out
    assert "complete already" not in err
    _, _, err = run(capsys, "planar", *SMALL, "--grid", "5,5,1")
    assert "complete already, nothing was computed" in err
    run(capsys, "planar", *SMALL, "--grid", "5,5,1", "--seed", "1")
    assert len(os.listdir(tmp_path / "stability")) == 2


def test_an_interrupted_sweep_says_how_to_continue(capsys, monkeypatch):
    asked = ["planar", *SMALL, "--grid", "5,5,1", "--out", "o"]
    with monkeypatch.context() as patch:
        patch.setattr("cdpr_drake.cli.grid_options.StopRequest.__call__", lambda self: True)
        code, out, err = run(capsys, *asked)
    assert code == 130
    assert out == ""
    assert "Interrupted after 0 of 50 poses; run again with the same arguments" in err
    assert run(capsys, *asked)[0] == 0


PATIENCE = 1800.0
"""Time for what has no end of its own [s]; on a busy machine it may take minutes."""

CHUNK, KEPT, POSES = 64, 3, 2 * 9 * 9 * 5
"""Poses per chunk; chunks that are kept before the end; poses of a small sweep."""

KILLED = killed_after(
    KEPT,
    f"""
from importlib import import_module
module = import_module("cdpr_drake.analyses.workspaces.stability_results")
module.CHUNK_POSES["sampled"] = {CHUNK}
""",
)
"""A command that is killed, while its workers compute, when it has kept some chunks."""


def test_a_killed_sweep_continues_and_says_so(capsys, tmp_path, monkeypatch):
    (tmp_path / "killed.py").write_text(KILLED)
    asked = ["acrobot_large", *SMALL, "--grid", "9,9,5", "--out", "k", "--json"]
    two = ["--workers", "2"]
    first = subprocess.Popen(
        [sys.executable, "killed.py", "stability", *asked, *two],
        cwd=tmp_path,
        start_new_session=True,
    )
    assert first.wait() == -signal.SIGKILL
    deadline = time.monotonic() + PATIENCE
    while any_left(first.pid):  # its workers end with it
        assert time.monotonic() < deadline
        time.sleep(0.02)
    monkeypatch.setitem(CHUNK_POSES, "sampled", CHUNK)
    sizes = [int(b) - int(a) for _, a, b in (c.stem.split("-") for c in chunks(tmp_path / "k"))]
    assert len(sizes) == KEPT
    code, out, err = run(capsys, *asked)
    assert code == 0
    said = " ".join(err.split())
    assert f"Continuing in k: {sum(sizes)} of {POSES} poses were there already" in said
    _, whole, _ = run(capsys, *asked[:-3], "--out", "whole", "--json")
    assert json.loads(whole) == json.loads(out)


def test_bounds_of_a_file_are_called_given(capsys, tmp_path):
    (tmp_path / "mine.yaml").write_text("r_A: 0.02\n")
    code, out, _ = run(
        capsys, "planar", *SMALL, "--grid", "3,3,1", "--bounds", "mine.yaml", "--vary",
        "r_A=0.01,0.03", "--out", "o", "--json",
    )  # fmt: skip
    assert code == 0
    found = json.loads(out)
    assert [row["bounds"] for row in found["workspaces"]] == ["given", "r_A=0.01", "r_A=0.03"]
    assert found["bounds"]["given"]["r_A"] == 0.02
    assert "baseline" not in out
    assert [value for value, _ in curves(load_workspaces(tmp_path / "o"))["r_A"]] == [
        0.01, 0.02, 0.03,
    ]  # fmt: skip


def test_options_that_a_verdict_does_not_use_do_not_matter(capsys):
    asked = ["planar", *SMALL, "--grid", "3,3,1", "--out", "o"]
    assert run(capsys, *asked)[0] == 0
    code, _, err = run(capsys, *asked, "--searches", "9", "--pieces", "7")
    assert code == 0
    assert "complete already" in err
    assert run(capsys, *asked, "--draws", "6")[0] == 2


@pytest.mark.parametrize("robot", REPRESENTATIVE_ROBOTS)
def test_coarse_grids_of_every_robot_have_points_in_its_frame(robot):
    loaded = load_robot(robot)
    box = workspace_defaults(loaded, robot)
    for words in ("1,1,1", "2,2,1" if loaded.is_planar() else "2,2,2", None):
        grid = parse_grid(words, [], box.lower, box.upper, box.step)
        assert make_question(robot, grid=grid).grid.size == grid.size


@pytest.mark.parametrize("command", ["simulate", "static", "tension", "study", "stability"])
def test_help_has_units(capsys, monkeypatch, command):
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit):
        main([command, "--help"])
    said = printed(capsys).out
    hints = get_type_hints(
        getattr(import_module(f"cdpr_drake.cli.{command}"), command), None, None, True
    )
    helps = [hint.__metadata__[0].help for hint in hints.values() if get_origin(hint) is Annotated]
    for unit in (unit for words in helps for unit in re.findall(r"\[.+?\]", words)):
        assert unit in said


SLOW = """
import sys, time
from pathlib import Path
from cdpr_drake.analyses.workspaces.static_feasible import StaticTask
from cdpr_drake.cli.app import main

look = StaticTask.__call__

def slow(self, start, stop):
    if (start, stop) == (0, 1):
        return look(self, start, stop)  # whether it is accepted, before a folder is made
    Path(f"began-{start}").touch()
    time.sleep(1e6)

StaticTask.__call__ = slow
if __name__ == "__main__":
    main(sys.argv[1:])
"""
"""A command whose chunks take longer than anybody waits."""


def test_ctrl_c_says_what_it_waits_for_and_a_second_one_drops_it(tmp_path):
    (tmp_path / "slow.py").write_text(SLOW)
    asked = ["acrobot_large", "--verdict", "sampled", "--grid", "20,20,6", "--workers", "2"]
    process = subprocess.Popen(
        [sys.executable, "slow.py", "stability", *asked, "--out", "o"],
        cwd=tmp_path, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + PATIENCE
        while len(list(tmp_path.glob("began-*"))) < 2:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        words = "Stopping after the chunks under way; Ctrl-C again drops them"
        # Lines of progress may come before and between, where it takes long.
        assert any(line.strip() == words for line in iter(process.stderr.readline, ""))
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=PATIENCE)[1]  # which reads: a full pipe would stop it
        assert process.returncode == 130
        assert "Interrupted after 0 of 4800 poses; run again" in messages(said)
        deadline = time.monotonic() + PATIENCE
        while any_left(process.pid):
            assert time.monotonic() < deadline
            time.sleep(0.02)
    finally:
        process.kill()
        process.stderr.close()


@pytest.mark.parametrize(
    ("change", "words"),
    [({"platform": {"mass": 50.0, "size": [0.11, 0.11, 0.07]}}, "no tensions within 0..60 N")],
)
def test_a_home_pose_that_cannot_be_held_spoils_the_picture_only(capsys, tmp_path, change, words):
    file = yaml.safe_load(robot_file("acrobot_small").read_text()) | change
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(file))
    code, out, err = run(capsys, "mine.yaml", *SMALL, "--grid", "2,2,2", "--out", "o")
    assert code == 0
    assert "cells inside" in out
    assert "workspace.html shows the robot at home without tensions" in err
    assert words in err
    assert {"results.json", "workspace.html"} <= set(os.listdir("o"))
    code, _, err = run(
        capsys, "mine.yaml", *SMALL, "--grid", "2,2,2", "--out", "p", "--limits", "0,5000"
    )
    assert code == 0
    assert ("note" in err) == ("home" in change)  # the picture is under the limits that are given


def chunks(folder):
    return list((folder / "chunks").iterdir())


def any_left(group):
    """Whether a group of processes has any."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["planar", "--scheme", "ibvs"], ["ibvs", "planar", "pbvs, pbvs-line"]),
        (["planar", "--scheme", "nonsense"], ["nonsense", "2.5d"]),
        (["nobody"], ["robot 'nobody' is unknown"]),
        (["planar", "--grid", "0,5,1"], ["grid", "x", "0 points"]),
        (["planar", "--grid", "1:0:0.1,5,1"], ["grid", "x", "lower <= upper"]),
        (["planar", "--grid", "5,5"], ["--grid", "'5,5'", "lower:upper:step"]),
        (["planar", "--grid", "5,5,a"], ["--grid", "lower:upper:step"]),
        (["planar", "--grid", "5,5,0:1:0.1"], ["z from 0 to 1"]),
        (["planar", "--grid", "5,5,4"], ["--grid", "found 4 points along z", "z = 0.3"]),
        (["acrobot_small", "--grid", "1e12,1e12,1e12"], ["--grid: found 1e+36 poses", "1e+07"]),
        (["acrobot_small", "--grid", "3000,3000,1000"], ["--grid: found 9e+09 poses", "1e+07"]),
        (["acrobot_small", "--grid", "0:1:1e-9,3,3"], ["--grid: found 9e+09 poses"]),
        (["acrobot_small", "--grid", "0:1:1e-320,3,3"], ["--grid: found inf poses"]),
        (["acrobot_small", "--grid", "inf,3,3"], ["--grid", "lower:upper:step"]),
        (
            ["acrobot_small", "--grid", "5:6:0.5,3,3"],
            ["grid", "x from 5 to 6", "(-0.6, -0.6, 0) to (0.6, 0.6, 1.2)"],
        ),
        (["planar", "--mass", "-1"], ["--mass: found -1", ">= 0 [kg]"]),
        (["planar", "--draws", "many"], ["--draws", "'many'", "see cdpr stability --help"]),
        ([], ["Missing argument 'robot'; see cdpr stability --help"]),
        (["README.md"], ["'README.md'", "has to end in .yaml"]),
        (["planar", "--bounds", "list.yaml"], ["list.yaml", "r_bp, d_theta_bp_deg, r_pc"]),
        (["planar", "--vary", "r_A"], ["--vary", "name=value"]),
        (["planar", "--vary", "r_A=-0.1"], ["r_A", "-0.1", ">= 0"]),
        (["planar", "--vary", "r_A=x"], ["--vary"]),
        (["planar", "--bounds", "nothing.yaml"], ["nothing.yaml", "no such file"]),
        (["planar", "--orientation", "1,2"], ["--orientation", "phi,theta,psi"]),
        (["planar", "--workers", "0"], ["--workers", "at least 1"]),
        (["acrobot_large", "--scenario", "acrobot_moving_tag"], ["target.motion", "rests"]),
        (["planar", "--draws", "0"], ["draws", "at least 1"]),
        (["planar", "--searches", "-1"], ["searches", "found -1", "at least 1"]),
        (["planar", "--pieces", "0"], ["pieces", "found 0", "at least 1"]),
        (["planar", "--verdict", "guessed"], ["verdict", "sampled"]),
        (["planar", "--scheduler", "tcp://127.0.0.1:9"], ["tcp://127.0.0.1:9", "this machine"]),
    ],
)
def test_refuses_bad_input_in_one_line(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.setattr("cdpr_drake.analyses.sweeps.workers.SCHEDULER_TIMEOUT", 0.3)
    (tmp_path / "list.yaml").write_text("- r_A\n")
    given = arguments if "--verdict" in arguments else [*arguments, "--verdict", "sampled"]
    code, _, err = run(capsys, *given)
    assert code == 2
    assert err.startswith("cdpr: ")
    assert len(err.strip().splitlines()) == 1
    for word in words:
        assert word in err
    assert not (tmp_path / "stability").exists()


def test_a_folder_of_other_arguments_is_refused(capsys):
    assert run(capsys, "planar", *SMALL, "--grid", "3,3,1", "--out", "o")[0] == 0
    code, _, err = run(capsys, "planar", *SMALL, "--grid", "3,3,1", "--seed", "7", "--out", "o")
    assert code == 2
    assert "options.seed is 0 there, 7 here" in err
