"""`cdpr stability`: what it prints and writes, continues and refuses."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from cdpr_drake.analyses.stability_workspaces import load_workspaces
from cdpr_drake.cli import main

SMALL = ["--verdict", "sampled", "--draws", "5", "--workers", "1"]
TINY = [*SMALL, "--grid", "3,3,3"]


def run(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(["stability", *arguments])
    out, err = capsys.readouterr()
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
    asked = ["planar", *SMALL, "--out", "o"]
    with monkeypatch.context() as patch:
        patch.setattr("cdpr_drake.cli.stability.StopRequest.__call__", lambda self: True)
        code, out, err = run(capsys, *asked)
    assert code == 130
    assert out == ""
    assert "Interrupted after 0 of 2178 poses; run again with the same arguments" in err
    assert run(capsys, *asked)[0] == 0


def test_a_killed_sweep_continues_and_says_so(tmp_path):
    code = "import sys; from cdpr_drake.cli import main; main(sys.argv[1:])"
    arguments = [
        sys.executable, "-c", code, "stability", "acrobot_large", "--verdict", "sampled",
        "--vary", "r_bp=0.05,0.1", "--workers", "2", "--out", "k", "--json",
    ]  # fmt: skip
    chunks = tmp_path / "k" / "chunks"
    first = subprocess.Popen(arguments, cwd=tmp_path, start_new_session=True)
    deadline = time.monotonic() + 60.0
    while not chunks.is_dir() or len(list(chunks.glob("*.npz"))) < 3:
        assert first.poll() is None, "ended before it was killed"
        assert time.monotonic() < deadline
        time.sleep(0.02)
    first.send_signal(signal.SIGKILL)
    first.wait()
    while any_left(first.pid):  # its workers end with it
        assert time.monotonic() < deadline
        time.sleep(0.02)
    kept = sum(1024 if "0013068" not in chunk.name else 780 for chunk in chunks.glob("*.npz"))
    arguments[arguments.index("--workers") + 1] = "1"
    second = subprocess.run(arguments, cwd=tmp_path, capture_output=True, text=True, check=True)
    said = " ".join(second.stderr.split())
    assert f"Continuing in k: {kept} of {4 * 13068} poses were there already" in said
    assert json.loads(second.stdout)["workspaces"][0]["Z"]["of_poses"] == 13068


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
        (["planar", "--vary", "r_A"], ["--vary", "name=value"]),
        (["planar", "--vary", "r_A=-0.1"], ["r_A", "-0.1", ">= 0"]),
        (["planar", "--vary", "r_A=x"], ["--vary"]),
        (["planar", "--bounds", "nothing.yaml"], ["nothing.yaml", "no such file"]),
        (["planar", "--orientation", "1,2"], ["--orientation", "phi,theta,psi"]),
        (["planar", "--workers", "0"], ["--workers", "at least 1"]),
        (["planar", "--draws", "0"], ["draws", "at least 1"]),
        (["planar", "--verdict", "guessed"], ["verdict", "sampled"]),
        (["planar", "--scheduler", "tcp://127.0.0.1:9"], ["tcp://127.0.0.1:9", "this machine"]),
    ],
)
def test_refuses_bad_input_in_one_line(capsys, tmp_path, monkeypatch, arguments, words):
    monkeypatch.setattr("cdpr_drake.analyses.sweep_workers.SCHEDULER_TIMEOUT", 0.3)
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
