"""`cdpr stability`: what it prints and writes, and how it continues."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from cdpr_drake.analyses.workspaces.stability import CHUNK_POSES, load_stability
from cdpr_drake.analyses.workspaces.stability_figures import curves, planes_figure
from cdpr_drake.cli.following import STOPPING
from tests.cli.commands import STORE_ARRAYS, answer, ended, killed_after, refuse, run, told
from tests.cli.conftest import only
from tests.messages import messages

SMALL = ("--verdict", "sampled", "--draws", "5", "--workers", "1")
TINY = (*SMALL, "--grid", "3,3,3")
PLANAR = ("stability", "planar", *SMALL, "--grid", "3,3,1")

pytestmark = pytest.mark.usefixtures("here")


def test_writes_a_folder_and_prints_json(capsys, here):
    (here / "mine.yaml").write_text("r_A: 0.02\n")
    asked = (
        "stability", "acrobot_small", *TINY, "--scheme", "ibvs", "--orientation", "0,0,0",
        "--orientation", "0,0,20", "--out", "o", "--figure-format", "svg", "--vary",
    )  # fmt: skip
    found = told(capsys, *asked, "r_A=0.005,0.05")
    assert json.loads((here / "o" / "results.json").read_text()) == found
    assert [row["bounds"] for row in found["workspaces"]] == ["baseline", "r_A=0.005", "r_A=0.05"]
    assert found["workspaces"][0]["Z"]["of_poses"] == 2 * 27
    assert found["interaction_matrix"] is None
    stored = load_stability(here / "o")
    assert stored.as_dict() == found
    assert [value for value, _ in curves(stored)["r_A"]] == [0.005, 0.05]
    names = os.listdir("o")
    assert {"planes.svg", "solids.svg", "volumes.svg", "workspace.html"} <= {*names}
    assert not [name for name in names if name.endswith(".png")]
    # Bounds of a file are called given.
    with only():
        found = told(capsys, *asked, "r_A=0.01,0.03", "--bounds", "mine.yaml", "--overwrite")
    assert [row["bounds"] for row in found["workspaces"]] == ["given", "r_A=0.01", "r_A=0.03"]
    assert found["bounds"]["given"]["r_A"] == 0.02
    values = [value for value, _ in curves(load_stability(here / "o"))["r_A"]]
    assert values == [0.01, 0.02, 0.03]


@pytest.mark.usefixtures("no_room_for_pictures")
def test_pictures_that_fail_cost_nothing_else(capsys, here):
    code, out, err = run(capsys, "stability", "acrobot_small", *TINY, "--out", "o", "--json")
    assert code == 3
    for name in ("planes.png", "solids.png", "workspace.html"):
        assert f"{name}: not written: " in err
    assert "No space left on device" in err
    assert json.loads(out) == json.loads((here / "o" / "results.json").read_text())
    assert {path.name for path in (here / "o").iterdir() if path.is_file()} == {
        ".cdpr_drake.json", ".cdpr_drake.lock", "results.json", "workspace.npz",
    }  # fmt: skip


@pytest.mark.usefixtures("without_pictures")
def test_says_which_interaction_matrix_it_took(capsys, here):
    for more, words in (
        ((), "L_s with [s_t]x, exact"),
        (("--printed-matrix",), "L_s with [e_t]x, as (1.47) of the servoing thesis prints it"),
    ):
        asked = ("stability", "acrobot_large", *SMALL, "--grid", "2,2,2", "--overwrite", *more)
        assert f"interaction matrix: {words}" in answer(capsys, *asked, "--out", "o")
        stored = load_stability(here / "o")
        assert stored.as_dict()["interaction_matrix"] == words
        title = planes_figure(stored).get_suptitle()
        # Its formulas are mathtext: $L_s$ with $[e_t]_\\times$; and it has several lines.
        assert words in " ".join(title.replace("$", "").replace("_\\times", "x").split())


@pytest.mark.usefixtures("without_pictures")
def test_the_same_arguments_find_their_folder_again(capsys):
    code, out, err = run(capsys, *PLANAR)
    assert code == 0
    assert "results: stability/planar-pbvs-sampled-" in out
    assert "reused the grid" not in err
    # Searches and pieces make no numbers of sampled verdicts.
    code, _, err = run(capsys, *PLANAR, "--searches", "9", "--pieces", "7")
    assert (code, "reused the grid of stability/planar-pbvs-sampled-" in err) == (0, True)
    assert ended(*PLANAR, "--seed", "1") == 0
    folder, _ = (f"stability/{name}" for name in os.listdir("stability"))
    assert "seed is" in refuse(capsys, *PLANAR, "--seed", "7", "--out", folder)
    assert ended(*PLANAR, "--seed", "7", "--out", folder, "--overwrite") == 0


PATIENCE = 1800.0
"""Time for what has no end of its own [s]; on a busy machine it may take minutes."""

CHUNK, KEPT, POSES = 16, 3, 5 * 5 * 3
"""Poses per chunk; chunks that are kept before the end; poses of a small sweep."""

KILLED = killed_after(
    KEPT,
    STORE_ARRAYS,
    f"""
from cdpr_drake.analyses.workspaces.stability import CHUNK_POSES
CHUNK_POSES["sampled"] = {CHUNK}
""",
)
"""A command that is killed, while its workers compute, when it has kept some chunks."""


def wait_until_none_is_left(group):
    """Until a group of processes has no process any more."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return
        time.sleep(0.02)
    raise AssertionError("processes are left")


@pytest.mark.usefixtures("without_pictures")
def test_a_killed_sweep_continues_and_says_so(capsys, here, monkeypatch):
    (here / "killed.py").write_text(KILLED)
    asked = ("stability", "acrobot_large", *SMALL, "--grid", "5,5,3")
    words = [sys.executable, "killed.py", *asked, "--workers", "2", "--out", "k"]
    first = subprocess.Popen(words, start_new_session=True)
    assert first.wait() == -signal.SIGKILL
    wait_until_none_is_left(first.pid)  # its workers end with it
    monkeypatch.setitem(CHUNK_POSES, "sampled", CHUNK)
    parts = [path.stem.split("-") for path in (here / "k" / "chunks").glob("[!.]*")]
    assert len(parts) == KEPT
    found = sum(int(stop) - int(start) for _, start, stop in parts)
    code, out, err = run(capsys, *asked, "--out", "k", "--json")
    assert code == 0
    said = " ".join(err.split())
    assert f"{found} of {POSES} poses were there already" in said
    assert told(capsys, *asked, "--out", "whole") == json.loads(out)


SLOW = """
import sys, time
from pathlib import Path
from cdpr_drake.analyses.workspaces import stability
from cdpr_drake.cli.app import main

def slow(held, servos, span):
    Path(f"began-{span[0]}").touch()
    time.sleep(1e6)

stability.judged_poses = slow
if __name__ == "__main__":
    main(sys.argv[1:])
"""
"""A command whose chunks take longer than anybody waits."""


def test_ctrl_c_says_what_it_waits_for_and_a_second_one_drops_it(here):
    (here / "slow.py").write_text(SLOW)
    asked = ("acrobot_large", "--verdict", "sampled", "--grid", "20,20,6", "--workers", "2")
    process = subprocess.Popen(
        [sys.executable, "slow.py", "stability", *asked, "--out", "o"],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + PATIENCE
        while len(list(here.glob("began-*"))) < 2:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        # Lines of progress may come before and between, where it takes long.
        assert any(line.strip() == STOPPING for line in iter(process.stderr.readline, ""))
        process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=PATIENCE)[1]  # which reads: a full pipe would stop it
        assert process.returncode == 130
        assert "stopped" in messages(said)
        wait_until_none_is_left(process.pid)
    finally:
        process.kill()
        process.stderr.close()
