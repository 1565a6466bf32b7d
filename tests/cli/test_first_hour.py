"""What a new user meets: notebooks, a robot that hangs nowhere, runs to be seen and sent around."""

import os
import socket

import numpy as np
import pytest
import yaml
from scipy.io import loadmat

from cdpr_drake.analyses.frame.files import copy_new
from cdpr_drake.analyses.programs import NOTEBOOKS
from cdpr_drake.analyses.visualization.meshcat_window import open_meshcat, page_address
from cdpr_drake.analyses.visualization.replay import RobotPicture
from cdpr_drake.errors import MeshcatError, OutputFolderError
from cdpr_drake.models.robot_loader import robot_file
from tests.cli.commands import ended, refuse, run, told

pytestmark = pytest.mark.usefixtures("here")

SERVO = ("acrobot_pbvs", "--camera", "projected")
TENSIONS = ("planar_computed_torque",)
ROBOTS = {SERVO: "acrobot_small", TENSIONS: "planar"}


def changed_robot(name, **values):
    """The text of a robot's file with some values at its top changed."""
    return yaml.safe_dump(yaml.safe_load(robot_file(name).read_text()) | values, sort_keys=False)


def test_notebooks_are_copied_and_nothing_is_overwritten(capsys, here):
    notebooks = sorted(path.name for path in NOTEBOOKS.glob("*.ipynb"))
    names = [*notebooks, "plain_client.py"]
    assert "tour.ipynb" in notebooks
    assert ended("notebooks", "here/there") == 0
    assert sorted(os.listdir("here/there")) == sorted(names)
    code, out, _ = run(capsys, "notebooks", "here/there")  # the same ones are no obstacle
    assert code == 0
    assert f"0 copied, {len(names)} were there" in out

    (here / "mine").mkdir()
    (here / "mine" / "tour.ipynb").write_text("my own")
    assert "mine: found tour.ipynb with other content" in refuse(capsys, "notebooks", "mine")
    assert os.listdir("mine") == ["tour.ipynb"]
    assert (here / "mine" / "tour.ipynb").read_text() == "my own"
    assert "found a file" in refuse(capsys, "notebooks", "mine/tour.ipynb")
    listed = told(capsys, "notebooks")
    assert [entry["name"] for entry in listed] == names
    assert "A tour of cdpr_drake" in str(listed)


def test_notebooks_leave_nothing_behind_where_the_disk_is_full(tmp_path, monkeypatch):
    monkeypatch.setattr(type(tmp_path), "mkdir", lambda self, **options: None)
    with pytest.raises(OutputFolderError, match="cannot be written"):
        copy_new({"a.ipynb": b"{}"}, tmp_path / "gone")


def test_view_draws_a_robot_that_cannot_be_held(capsys, here):
    content = changed_robot("acrobot_small", home={"position": [0.5, 0.5, 1.1]})
    (here / "hung.yaml").write_text(content)
    code, out, err = run(capsys, "view", "hung.yaml", "--html", "page.html")
    assert (code, out.strip()) == (0, "page.html")
    assert "warning: the cables are grey: acrobot_small cannot hold the platform" in err
    assert (here / "page.html").stat().st_size > 100_000


def test_meshcat_listens_where_it_is_told():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    meshcat = open_meshcat("127.0.0.1", port)
    assert page_address(meshcat) == f"http://127.0.0.1:{port}"
    for address, words in (
        (("127.0.0.1", port), "name another port"),
        (("localhost", 80), "accepted: 1024 to 65535"),
        (("8.8.8.8",), "accepted: a name or address of this machine"),
    ):
        with pytest.raises(MeshcatError, match=words):
            open_meshcat(*address)


@pytest.mark.parametrize("scenario", [SERVO, TENSIONS], ids=["servo", "tensions"])
@pytest.mark.usefixtures("without_pictures")
def test_a_live_run_has_the_same_numbers(capsys, here, monkeypatch, scenario):
    drawn = []
    draw = RobotPicture.draw

    def watched(self, *arguments):
        drawn.append(arguments[2])
        draw(self, *arguments)

    monkeypatch.setattr(RobotPicture, "draw", watched)
    words = ("simulate", *scenario, "--duration", "0.3")
    code, _, err = run(capsys, *words, "--out", "live", "--meshcat")
    assert code == 0
    assert f"{scenario[0]} at http://localhost:" in err
    assert len(drawn) >= 8  # before the start, and 25 a second
    assert ended(*words, "--out", "plain") == 0
    logs = [(here / name / "log.csv").read_bytes() for name in ("live", "plain")]
    assert logs[0] == logs[1]


@pytest.mark.parametrize("scenario", [SERVO, TENSIONS], ids=["servo", "tensions"])
@pytest.mark.usefixtures("without_pictures")
def test_a_folder_can_be_sent_and_repeated(here, scenario):
    """The folder's robot counts, not the one of the same name that is installed."""
    name = ROBOTS[scenario]
    platform = yaml.safe_load(robot_file(name).read_text())["platform"]
    heavier = changed_robot(name, platform=platform | {"mass": 1.25 * platform["mass"]})
    (here / "heavier.yaml").write_text(heavier)
    words = ("simulate", *scenario, "--duration", "0.1", "--out")
    assert ended(*words, "sent", "--set", "robot=heavier.yaml") == 0
    (here / "heavier.yaml").unlink()
    (here / "elsewhere").mkdir()
    (here / "sent").rename(here / "elsewhere" / "received")

    assert ended("simulate", "elsewhere/received", "--out", "again") == 0
    for file in ("log.csv", "robot.yaml", "scenario.yaml"):
        sent, again = here / "elsewhere" / "received" / file, here / "again" / file
        assert sent.read_bytes() == again.read_bytes()
    assert yaml.safe_load((here / "again" / "robot.yaml").read_text())["name"] == name
    assert ended(*words, "installed") == 0
    logs = [(here / folder / "log.csv").read_bytes() for folder in ("again", "installed")]
    assert logs[0] != logs[1]


@pytest.mark.parametrize("scenario", [SERVO, ("acrobot_computed_torque",)])
@pytest.mark.usefixtures("without_pictures")
def test_the_log_for_matlab_and_as_parquet(here, scenario):
    parquet = pytest.importorskip("pyarrow.parquet")
    asked = ("--duration", "0.1", "--out", "out", "--log-format", "csv,mat,parquet")
    assert ended("simulate", *scenario, *asked) == 0
    with np.load(here / "out" / "log.npz") as file:
        log = dict(file)
    mat = loadmat(here / "out" / "log.mat")
    assert set(log) == {name for name in mat if name[0] != "_"} - {"columns"}
    for name in log:
        np.testing.assert_array_equal(mat[name].reshape(log[name].shape), log[name])
    names = [str(cell[0]) for cell in mat["columns"]["tensions"][0, 0].ravel()]
    assert names == [f"C{k}_n" for k in range(1, 9)]
    header, *rows = (here / "out" / "log.csv").read_text().splitlines()
    table = parquet.read_table(here / "out" / "log.parquet")
    assert table.column_names == header.split(",")
    numbers = np.array([[float(x or "nan") for x in row.split(",")] for row in rows])
    np.testing.assert_array_equal(np.column_stack([c.to_numpy() for c in table.columns]), numbers)
