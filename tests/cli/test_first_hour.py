"""What a new user meets: lists, notebooks, a robot that hangs nowhere, runs to be sent around."""

import json
import os
import socket

import numpy as np
import pytest
import yaml
from scipy.io import loadmat

from cdpr_drake.analyses.visualization.live_view import LiveView
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat, page_address
from cdpr_drake.cli import notebooks as notebook_command
from cdpr_drake.errors import MeshcatError
from cdpr_drake.models.robot_loader import robot_file
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.cli.test_cli import QUICK, refuse, run

pytestmark = pytest.mark.usefixtures("_in_a_folder_of_its_own")


@pytest.fixture
def _in_a_folder_of_its_own(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def changed_robot(name, **values):
    """The text of a robot's file with some values at its top changed."""
    return yaml.safe_dump(yaml.safe_load(robot_file(name).read_text()) | values, sort_keys=False)


def test_all_problems_of_a_file_have_a_line_each(capsys, tmp_path):
    (tmp_path / "mine.yaml").write_text("name: x\nrobot: y\ndurration: 3\ntitle: [1]\n")
    code, _, err = run(capsys, "simulate", "mine.yaml")
    lines = err.splitlines()
    assert code == 2
    assert len(lines) > 4
    assert all(line.startswith("cdpr: ") and "mine.yaml:" in line for line in lines)
    assert "did you mean duration?" in err
    assert "robot 'y' is unknown" in err


def test_scenarios_lists_all(capsys):
    code, out, _ = run(capsys, "scenarios", "--json")
    assert code == 0
    facts = {fact["name"]: fact for fact in json.loads(out)}
    assert list(facts) == list(scenario_names())
    assert facts["acrobot_ibvs"]["scheme"] == "ibvs"
    assert facts["caroca_computed_torque"]["kind"] == "tension_control"
    assert facts["caroca_computed_torque"]["camera"] is None
    _, out, _ = run(capsys, "scenarios")
    assert all(name in out for name in facts)


def test_notebooks_are_copied_and_nothing_is_overwritten(capsys, tmp_path):
    notebooks = sorted(path.name for path in notebook_command.FOLDER.glob("*.ipynb"))
    names = [*notebooks, "plain_client.py"]
    assert "tour.ipynb" in notebooks
    assert run(capsys, "notebooks", "here/there")[0] == 0
    assert sorted(os.listdir(tmp_path / "here" / "there")) == sorted(names)
    code, out, _ = run(capsys, "notebooks", "here/there")  # the same ones are no obstacle
    assert code == 0
    assert f"0 copied, {len(names)} were there" in out

    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "tour.ipynb").write_text("my own")
    assert "mine: found tour.ipynb with other content" in refuse(capsys, "notebooks", "mine")
    assert os.listdir(tmp_path / "mine") == ["tour.ipynb"]
    assert (tmp_path / "mine" / "tour.ipynb").read_text() == "my own"
    assert "found a file" in refuse(capsys, "notebooks", "mine/tour.ipynb")
    _, out, _ = run(capsys, "notebooks", "--json")
    assert [entry["name"] for entry in json.loads(out)] == names
    assert "A tour of cdpr_drake" in out


def test_notebooks_leave_nothing_behind_where_the_disk_is_full(tmp_path, monkeypatch):
    monkeypatch.setattr(type(tmp_path), "mkdir", lambda self, **options: None)
    with pytest.raises(notebook_command.OutputFolderError, match="cannot be written"):
        notebook_command.copy_new({"a.ipynb": b"{}"}, tmp_path / "gone")


def test_view_draws_a_robot_that_cannot_be_held(capsys, tmp_path):
    content = changed_robot("acrobot_small", home={"position": [0.5, 0.5, 1.1]})
    (tmp_path / "hung.yaml").write_text(content)
    code, out, err = run(capsys, "view", "hung.yaml", "--html", "page.html")
    assert code == 0
    assert out.strip() == "page.html"
    assert "warning: the cables are grey: acrobot_small cannot hold the platform" in err
    assert (tmp_path / "page.html").stat().st_size > 100_000


def test_meshcat_listens_where_it_is_told():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    meshcat = open_meshcat("127.0.0.1", port)
    assert page_address(meshcat) == f"http://127.0.0.1:{port}"
    with pytest.raises(MeshcatError, match="name another port"):
        open_meshcat("127.0.0.1", port)
    with pytest.raises(MeshcatError, match="accepted: 1024 to 65535"):
        open_meshcat(port=80)
    with pytest.raises(MeshcatError, match="accepted: a name or address of this machine"):
        open_meshcat("8.8.8.8")


def test_hosts_and_ports_that_make_no_sense_are_refused(capsys):
    assert "--host" in refuse(capsys, "view", "planar", "--host", "no such host")
    assert "without --html" in refuse(capsys, "view", "planar", "--html", "a", "--port", "7000")
    assert "--meshcat only" in refuse(capsys, "simulate", *QUICK, "--port", "7000")


@pytest.mark.parametrize("scenario", ["acrobot_pbvs", "planar_computed_torque"])
@pytest.mark.usefixtures("without_pictures")
def test_a_live_run_has_the_same_numbers(capsys, tmp_path, monkeypatch, scenario):
    drawn = []
    draw = LiveView.draw

    def watched(self, *arguments):
        drawn.append(arguments[0])
        draw(self, *arguments)

    monkeypatch.setattr(LiveView, "draw", watched)
    options = [scenario, "--duration", "0.3"]
    options += ["--camera", "projected"] if scenario == "acrobot_pbvs" else []
    code, _, err = run(capsys, "simulate", *options, "--out", "live", "--meshcat")
    assert code == 0
    assert f"{scenario} at http://localhost:" in err
    assert len(drawn) >= 7  # 25 a second
    run(capsys, "simulate", *options, "--out", "plain")
    logs = [(tmp_path / name / "log.csv").read_bytes() for name in ("live", "plain")]
    assert logs[0] == logs[1]


@pytest.mark.parametrize("scenario", ["acrobot_pbvs", "planar_computed_torque"])
@pytest.mark.usefixtures("without_pictures")
def test_a_folder_can_be_sent_and_repeated(capsys, tmp_path, scenario):
    """The folder's robot counts, not the one of the same name that is installed."""
    name = {"acrobot_pbvs": "acrobot_small", "planar_computed_torque": "planar"}[scenario]
    platform = yaml.safe_load(robot_file(name).read_text())["platform"]
    heavier = changed_robot(name, platform=platform | {"mass": 1.25 * platform["mass"]})
    (tmp_path / "heavier.yaml").write_text(heavier)
    options = [scenario, "--duration", "0.2", "--set", "robot=heavier.yaml"]
    options += ["--camera", "projected"] if scenario == "acrobot_pbvs" else []
    assert run(capsys, "simulate", *options, "--out", "sent")[0] == 0
    (tmp_path / "heavier.yaml").unlink()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "sent").rename(tmp_path / "elsewhere" / "received")

    assert run(capsys, "simulate", "elsewhere/received", "--out", "again")[0] == 0
    for file in ("log.csv", "robot.yaml", "scenario.yaml"):
        sent, again = tmp_path / "elsewhere" / "received" / file, tmp_path / "again" / file
        assert sent.read_bytes() == again.read_bytes()
    assert yaml.safe_load((tmp_path / "again" / "robot.yaml").read_text())["name"] == name

    installed = [word for word in options if word not in ("--set", "robot=heavier.yaml")]
    assert run(capsys, "simulate", *installed, "--out", "installed")[0] == 0
    logs = [(tmp_path / folder / "log.csv").read_bytes() for folder in ("again", "installed")]
    assert logs[0] != logs[1]


@pytest.mark.usefixtures("without_pictures")
def test_a_folder_without_a_run_is_refused(capsys, tmp_path):
    (tmp_path / "empty").mkdir()
    assert "without scenario.yaml" in refuse(capsys, "simulate", "empty")
    (tmp_path / "acrobot_pbvs").mkdir()  # a name of a scenario stays one
    assert "without scenario.yaml" in refuse(capsys, "simulate", "./acrobot_pbvs")
    assert run(capsys, "simulate", "acrobot_pbvs", *QUICK, "--out", "out")[0] == 0


@pytest.mark.parametrize("options", [QUICK, ["acrobot_computed_torque", "--duration", "0.1"]])
@pytest.mark.usefixtures("without_pictures")
def test_the_log_for_matlab(capsys, tmp_path, options):
    assert run(capsys, "simulate", *options, "--out", "out", "--log-format", "mat")[0] == 0
    with np.load(tmp_path / "out" / "log.npz") as file:
        log = dict(file)
    mat = loadmat(tmp_path / "out" / "log.mat")
    assert set(log) == {name for name in mat if name[0] != "_"} - {"columns"}
    for name in log:
        np.testing.assert_array_equal(mat[name].reshape(log[name].shape), log[name])
    names = [str(cell[0]) for cell in mat["columns"]["tensions"][0, 0].ravel()]
    assert names == [f"C{k}_n" for k in range(1, 9)]
    assert not list((tmp_path / "out").glob("*.parquet"))


@pytest.mark.usefixtures("without_pictures")
def test_the_log_as_parquet(capsys, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert run(capsys, "simulate", *QUICK, "--out", "out", "--log-format", "csv,parquet")[0] == 0
    header, *rows = (tmp_path / "out" / "log.csv").read_text().splitlines()
    table = parquet.read_table(tmp_path / "out" / "log.parquet")
    assert table.column_names == header.split(",")
    numbers = np.array([row.split(",") for row in rows], float)
    np.testing.assert_array_equal(np.column_stack([c.to_numpy() for c in table.columns]), numbers)


def test_log_formats_are_refused_before_anything_runs(capsys, tmp_path, monkeypatch):
    assert "accepted: some of csv,npz,mat" in refuse(
        capsys, "simulate", *QUICK, "--log-format", "xlsx"
    )
    monkeypatch.setattr("cdpr_drake.analyses.reporting.exported_logs.find_spec", lambda name: None)
    words = refuse(capsys, "simulate", *QUICK, "--log-format", "mat,parquet")
    assert "pip install 'cdpr_drake[parquet]'" in words
    assert os.listdir(tmp_path) == []


def test_an_infeasible_tension_is_an_answer(capsys):
    code, out, _ = run(capsys, "tension", "acrobot_small", "--pose", "0.5,0.5,1.1", "--json")
    assert json.loads(out)["status"] == "infeasible"
    assert code == 0
    assert "The exit code is 0 for every answer" in " ".join(
        run(capsys, "tension", "--help")[1].split()
    )
