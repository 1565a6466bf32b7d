"""The command: what it prints, what it refuses, and with which exit code."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cdpr_drake.cli.app import main
from cdpr_drake.kernel_cache.kernel_list import needed_kernels
from cdpr_drake.models.robot_loader import robot_names
from cdpr_drake.systems.scenarios.files import scenario_file
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from tests.messages import messages, printed
from tests.record_kernels import kept_kernels

QUICK = ["--camera", "projected", "--duration", "0.3"]


def run(capsys, *arguments):
    """Exit code, stdout and stderr of a command."""
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    out, err = printed(capsys)
    return ended.value.code, out, err


def refuse(capsys, *arguments):
    """The one line that a command says when it refuses, apart from warnings of the scenario."""
    code, _, err = run(capsys, *arguments)
    assert code == 2
    lines = err.splitlines(keepends=True)
    err = "".join(line for line in lines if not line.startswith("warning: "))
    assert err.startswith("cdpr: ")
    assert len(err.strip().splitlines()) == 1
    return err


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_simulate_writes_a_folder_and_prints_json(capsys, tmp_path):
    code, out, _ = run(capsys, "simulate", *QUICK, "--out", "there", "--json", "--seed", "4")
    assert code == 0
    summary = json.loads(out)
    assert summary["seed"] == 4
    assert summary["outcome"] == "timeout"
    assert json.loads((tmp_path / "there" / "summary.json").read_text()) == summary
    assert os.listdir(tmp_path) == ["there"]


@pytest.mark.usefixtures("without_pictures")
def test_simulate_without_out_numbers_its_folders(capsys, tmp_path):
    for _ in range(2):
        assert run(capsys, "simulate", *QUICK)[0] == 0
    assert sorted(os.listdir(tmp_path / "runs")) == ["acrobot_pbvs_taut", "acrobot_pbvs_taut-2"]


@pytest.mark.usefixtures("without_pictures")
def test_simulate_takes_overrides(capsys, tmp_path):
    run(capsys, "simulate", *QUICK, "--out", "o", "--set", "controller.lambda_0=1.25")
    assert "lambda_0: 1.25" in (tmp_path / "o" / "scenario.yaml").read_text()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["foo"], ["scenario 'foo' is unknown", "acrobot_against_wind", "planar_pbvs"]),
        (["nothing.yaml"], ["nothing.yaml", "no such scenario file"]),
        (["--set", "robot=foo"], ["robot 'foo' is unknown", "acrobot_small"]),
        (["--set", "foo.bar=1"], ["--set foo.bar", "no key foo"]),
        (["--set", "controller.lamda_0=1"], ["did you mean lambda_0?"]),
        (["--set", "controller.lambda_0"], ["accepted: key=value"]),
        (["--set", "controller.lambda_0=-1"], ["found -1", "> 0"]),
        (["--set", "controller.lambda_infinity=9"], ["lambda_infinity", "at most lambda_0"]),
        (["--set", "initial_pose.position=[0,0]"], ["found [0, 0]", "3 numbers"]),
        (["--set", "initial_pose.position=[.nan,0,0]"], ["found .nan"]),
        (["--set", "initial_pose.position=[0,0,9]"], ["(0, 0, 9)", "outside the frame"]),
        (["--set", "initial_pose.position=[0,0,1.1]"], ["cannot hold the platform"]),
        (["--set", "camera.mount=nose"], ["camera.mount", "onboard"]),
        (["--camera", "film"], ["camera.kind", "rendered, projected"]),
        (["--duration", "-1"], ["duration", "> 0"]),
        (["--duration", "soon"], ["--duration"]),
        (["--seed", "1.5"], ["--seed"]),
        (["--out", "file"], ["found a file"]),
        (["--out", "full"], ["holds files already", "--overwrite"]),
        (["--out", "file/below"], ["cannot be written"]),
        (["--nonsense"], ["--nonsense"]),
    ],
)
def test_simulate_refuses(capsys, tmp_path, arguments, words):
    (tmp_path / "file").write_text("")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "old").write_text("")
    line = refuse(capsys, "simulate", *arguments)
    for word in words:
        assert word in line
    assert sorted(os.listdir(tmp_path)) == ["file", "full"]
    assert os.listdir(tmp_path / "full") == ["old"]


def test_a_malformed_file_is_named_with_its_line(capsys, tmp_path):
    (tmp_path / "bad.yaml").write_text("name: x\nrobot: [1,\n")
    line = refuse(capsys, "simulate", "bad.yaml")
    assert "bad.yaml:3: does not parse as YAML" in line


def test_no_egl_is_said_before_anything_runs(capsys, tmp_path, monkeypatch):
    def no_library(name):
        raise OSError(name)

    monkeypatch.setattr("cdpr_drake.models.rendered_camera.CDLL", no_library)
    line = refuse(capsys, "simulate", "--duration", "0.2")
    assert "libegl1" in line
    assert "--camera projected" in line
    assert os.listdir(tmp_path) == []


@pytest.mark.usefixtures("without_pictures")
def test_overwrite_replaces_results_and_nothing_else(capsys, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "old").write_text("")
    code, _, err = run(capsys, "simulate", *QUICK, "--out", "out", "--overwrite")
    assert code == 2
    assert "did not write" in err
    assert (tmp_path / "out" / "old").exists()
    (tmp_path / "out" / ".cdpr_drake.json").write_text("{}")
    assert run(capsys, "simulate", *QUICK, "--out", "out", "--overwrite")[0] == 0
    assert not (tmp_path / "out" / "old").exists()


def test_a_page_replaces_nothing_but_pages(capsys, tmp_path):
    """It once wrote over whatever was named, a robot's file too."""
    mine = tmp_path / "mine.yaml"
    mine.write_text("years of work")
    for name in ("mine.yaml", "new.txt", "new"):
        words = refuse(capsys, "view", "acrobot_small", "--html", name)
        assert f"--html: found {name}; accepted: a file that ends in .html" in words
    assert mine.read_text() == "years of work"
    assert os.listdir(tmp_path) == ["mine.yaml"]


@pytest.mark.parametrize(
    "arguments",
    [
        ["tension", "x" * 3000, "--pose", "0,0,0"],
        ["tension", "acrobot_small", "--pose", "0,0,0.2", "--mass", "x" * 3000],
        ["simulate", "y" * 3000 + ".yaml"],
        ["simulate", "--set", "robot=" + "z" * 3000],
        ["static", "acrobot_small", "--pose", "1," * 3000],
    ],
)
def test_long_words_are_refused_in_a_line_that_can_be_read(capsys, arguments):
    said = refuse(capsys, *arguments)
    assert len(said) <= 501
    assert " ... " in said


def test_words_do_not_steer_the_terminal(capsys):
    said = refuse(capsys, "simulate", "\x1b[31mred\u202e\t.yaml")
    assert "\\x1b[31mred\\u202e\\t.yaml: there is no such scenario file" in said
    assert said.rstrip("\n").isprintable()


@pytest.mark.parametrize("name", ["../../X", "/X", ".hidden", "a b", "x" * 65])
def test_names_that_could_be_paths_are_refused(capsys, tmp_path, name):
    scenario = tmp_path / "mine.yaml"
    scenario.write_text(scenario_file("acrobot_pbvs").read_text().replace("acrobot_pbvs", name))
    code, _, err = run(capsys, "simulate", str(scenario), "--camera", "projected")
    assert code == 2
    assert "name: found" in err
    assert os.listdir(tmp_path) == ["mine.yaml"]


def test_units_reach_the_terminal(capsys):
    """Square brackets once were taken for markup."""
    code, out, _ = run(capsys, "static", "acrobot_small", "--pose", "0,0,0.3")
    assert code == 0
    assert "length [m]" in out
    assert "tension [N]" in out


def test_the_package_is_a_command():
    words = [sys.executable, "-m", "cdpr_drake", "--version"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("cdpr_drake ")


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
try:
    main(sys.argv[2:])
finally:
    pathlib.Path("simulates").write_text(json.dumps(asked))
"""
"""The command, which leaves a file when it has simulated something, however long that takes; in the
end with the kernels that it has asked for."""

ROOT = Path(__file__).parent.parent.parent


def start_endless_run(folder, engine):
    """A run that simulates by now, and would for long."""
    words = ["simulate", "--camera", "projected", "--out", "out", "--duration", "100000"]
    process = subprocess.Popen(
        [sys.executable, "-c", MARKED, str(ROOT), *words, "--set", "stop.hold=100000",
         "--set", f"integration.engine={engine}"],
        cwd=folder, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    while not (folder / "simulates").exists():
        assert process.poll() is None
        time.sleep(0.05)
    return process


def test_sigterm_keeps_what_was_simulated(tmp_path):
    """As batch systems and containers stop a program."""
    process = start_endless_run(tmp_path, "plant")
    process.send_signal(signal.SIGTERM)
    process.communicate()
    assert process.returncode == 130
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["outcome"] == "interrupted"
    assert sorted(os.listdir(tmp_path)) == ["out", "simulates"]
    asked = kept_kernels(json.loads((tmp_path / "simulates").read_text()))
    listed = {(k.name, k.signature) for k in needed_kernels([DEFAULT_SCENARIO])}
    assert asked
    assert asked <= listed, "python -m tests.record_kernels makes a new list"


def test_a_figure_that_fails_is_named_and_the_rest_is_kept(capsys, tmp_path, monkeypatch):
    def broken(result):
        raise RuntimeError("no font")

    monkeypatch.setattr("cdpr_drake.analyses.simulation.run_figures.error_figure", broken)
    code, out, err = run(capsys, "simulate", *QUICK, "--out", "out", "--json")
    assert code == 3
    assert "error.png: not written: no font" in err
    assert json.loads(out)["outcome"] == "timeout"
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"summary.json", "log.npz", "replay.html", "tensions.png"} <= names
    assert "error.png" not in names


def test_ctrl_c_keeps_what_was_simulated(tmp_path):
    process = start_endless_run(tmp_path, "automatic")
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert process.returncode == 130
    assert "Interrupted at" in err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["outcome"] == "interrupted"
    assert summary["sim_time_s"] > 0.0


def test_robots_lists_all(capsys):
    code, out, _ = run(capsys, "robots", "--json")
    assert code == 0
    assert [robot["name"] for robot in json.loads(out)] == list(robot_names())
    code, out, _ = run(capsys, "robots")
    assert code == 0
    for name in robot_names():
        assert name in out


def test_view_writes_a_page(capsys, tmp_path):
    code, out, _ = run(capsys, "view", "planar", "--html", "robot.html")
    assert code == 0
    assert out.strip() == "robot.html"
    assert (tmp_path / "robot.html").stat().st_size > 100_000
    assert run(capsys, "view", "planar", "--html", "robot.html")[0] == 0
    (tmp_path / "notes.html").write_text("years of work")
    assert "did not write" in refuse(capsys, "view", "planar", "--html", "notes.html")
    assert (tmp_path / "notes.html").read_text() == "years of work"


def test_view_refuses(capsys):
    assert "unknown" in refuse(capsys, "view", "foo")
    assert "no folder" in refuse(capsys, "view", "planar", "--html", "no/such/page.html")


def test_doctor(capsys):
    code, out, _ = run(capsys, "doctor", "--json")
    assert code == 0
    assert all(finding["passed"] for finding in json.loads(out))


def test_bench(capsys, monkeypatch):
    code, out, _ = run(capsys, "bench", "tension", "--quick", "--json")
    assert code == 0
    names = [row["name"] for row in json.loads(out)["tension"]]
    assert "exact QP, one call" in names
    assert "unknown" in refuse(capsys, "bench", "foo")
    monkeypatch.setattr("cdpr_drake.cli.bench.BENCH_GROUPS", {})  # as in a wheel
    assert "source checkout" in refuse(capsys, "bench", "tension")


def test_help_and_version(capsys):
    code, out, _ = run(capsys)
    assert code == 0
    assert "simulate" in out
    code, out, _ = run(capsys, "--version")
    assert code == 0
    assert "Drake 1." in out
    assert "No such command" in refuse(capsys, "fly")


def test_a_target_out_of_view_is_refused_before_anything_is_simulated(capsys, tmp_path):
    where = ("--set", "target.pose.position=[-0.5, 0.5, 0]", "--out", str(tmp_path / "run"))
    code, _, err = run(capsys, "simulate", "acrobot_pbvs", "--camera", "projected", *where)
    assert code == 2
    assert "its middle would be at (2937, 3134) px" in err
    assert not (tmp_path / "run").exists()


@pytest.mark.usefixtures("without_pictures")
def test_a_goal_that_is_not_seen_is_a_warning(capsys, tmp_path):
    goal = ("--set", "desired.position=[0.1, 0, 0.09]", "--duration", "0.1")
    code, _, err = run(
        capsys,
        "simulate",
        "acrobot_pbvs",
        "--camera",
        "projected",
        *goal,
        "--out",
        str(tmp_path / "r"),
    )
    assert code == 0
    assert "warning: acrobot_pbvs: desired: the camera does not see all of the target" in err


def test_a_broken_graphics_driver_is_one_line():
    """Without a vendor's library VTK ends its process by SIGSEGV at the first image."""
    found = subprocess.run(
        [sys.executable, "-m", "cdpr_drake", "simulate", "--duration", "0.1", "--out", "there"],
        env={**os.environ, "__EGL_VENDOR_LIBRARY_FILENAMES": os.devnull},
        capture_output=True,
        text=True,
        check=False,
    )
    assert found.returncode == 2
    (line,) = messages(found.stderr).splitlines()
    assert line.startswith("cdpr: ")
    assert "SIGSEGV" in line
    assert "--camera projected" in line
    assert not os.path.exists("there")
