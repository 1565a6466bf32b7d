"""Commands that answer at once: lists, pages, the installation, help; and what help says."""

import errno
import inspect
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from pkgutil import resolve_name

import pytest

from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.models.robot_loader import load_robot, robot_names
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.cli.commands import ended, refuse, run, told

pytestmark = pytest.mark.usefixtures("here")


def test_the_package_is_a_command():
    words = [sys.executable, "-m", "cdpr_drake", "--version"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert re.match(r"cdpr_drake .*, Drake 1\.", done.stdout)


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_units_and_examples(capsys, monkeypatch, command):
    """The words of each argument reach the terminal as they stand in the verb's docstring."""
    monkeypatch.setenv("COLUMNS", "250")
    code, out, _ = run(capsys, command, "--help")
    said = " ".join(out.replace("│", " ").split())
    docstring = inspect.getdoc(resolve_name(COMMANDS[command].verb))
    arguments = " ".join(docstring.partition("Args:")[2].partition("Raises:")[0].split())
    assert code == 0
    for words in (*re.findall(r"\[[^]\[]+?\]", arguments), *COMMANDS[command].examples):
        assert words in said


def test_view_writes_a_page(capsys, here):
    code, out, _ = run(capsys, "view", "planar", "--html", "robot.html")
    assert (code, out.strip()) == (0, "robot.html")
    assert (here / "robot.html").stat().st_size > 100_000
    assert ended("view", "planar", "--html", "robot.html") == 0
    (here / "notes.html").write_text("years of work")
    assert "did not write" in refuse(capsys, "view", "planar", "--html", "notes.html")
    assert (here / "notes.html").read_text() == "years of work"


def test_scenarios_lists_all(capsys, monkeypatch):
    monkeypatch.setattr("cdpr_drake.systems.diagrams.load.load_scenario", cache(load_scenario))
    facts = {fact["name"]: fact for fact in told(capsys, "scenarios")}
    assert list(facts) == list(scenario_names())
    assert facts["acrobot_ibvs"]["scheme"] == "ibvs"
    assert facts["caroca_computed_torque"]["kind"] == "tension_control"
    assert facts["caroca_computed_torque"]["camera"] is None
    _, out, _ = run(capsys, "scenarios")
    assert all(name in out for name in facts)


@pytest.fixture(scope="module")
def every_robot():
    return {name: load_robot(name) for name in robot_names()}


@pytest.fixture
def library(monkeypatch, every_robot):
    """The files are read once."""
    monkeypatch.setattr("cdpr_drake.analyses.catalogues.load_robot", every_robot.get)


def test_robots_lists_all(capsys, library):
    assert [robot["name"] for robot in told(capsys, "robots")] == list(robot_names())
    _, out, _ = run(capsys, "robots")
    assert all(name in out for name in robot_names())


@pytest.mark.parametrize(
    ("options", "some", "others"),
    [
        ("--motion 2t1r", {"planar", "kntu_planar"}, {"caroca", "fast"}),
        ("--cables 10", {"segesta"}, {"caroca", "planar"}),
        ("--cables 9-", {"segesta"}, {"cogiro"}),
        ("--cables -4", {"planar"}, {"fast"}),
        ("--cables 6-8", {"fast", "cogiro"}, {"segesta", "planar"}),
        ("--suspended", {"cogiro", "fast", "caroca"}, {"ipanema_1", "planar", "macarm"}),
        ("--not-suspended --cables 8", {"ipanema_1", "macarm"}, {"cogiro", "planar"}),
        ("--underactuated", {"grab_three", "grab_four"}, {"spider_camera", "fast"}),
        ("--motion 3T --suspended", {"spider_camera"}, {"planar_point", "cogiro"}),
        ("--camera", {"acrobot_small"}, {"fast"}),
        ("--search IPAnema", {"ipanema_1", "ipanema_2", "ipanema_3"}, {"fast"}),
    ],
)
def test_robots_are_filtered(capsys, library, options, some, others):
    found = {robot["name"] for robot in told(capsys, "robots", *options.split())}
    assert some <= found
    assert not others & found


def test_a_gallery_of_robots(capsys, here, library, every_robot):
    code, out, _ = run(capsys, "robots", "--gallery", "robots.html", "--cables", "4-")
    assert (code, out.strip()) == (0, "robots.html")
    words = (here / "robots.html").read_text(encoding="utf-8")
    for name, robot in every_robot.items():
        assert (f"<h2>{name}</h2>" in words) == (len(robot.cables) >= 4)
    assert not re.search(r"<script|https?:|url\(|@import", words)  # nothing is fetched


def test_a_page_that_cannot_be_finished_leaves_nothing(capsys, monkeypatch, here, library):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    page = here / "robots.html"
    page.write_text("before")
    monkeypatch.setattr(Path, "replace", full)
    words = ("robots", "--cables", "10", "--gallery", "robots.html")
    assert "No space left" in refuse(capsys, *words)
    assert page.read_text() == "before"
    assert list(here.iterdir()) == [page]


def test_options_of_imported_logs_that_change_nothing_are_told(capsys, here):
    log = "time_s,C1_length_m\n0,1\n0.1,1.1\n0.2,1.2\n"
    (here / "log.csv").write_text(log)
    words = ("import-log", "log.csv", "--rate", "10")
    code, said, _ = run(capsys, *words, "--body", "P", "--cables", "A,B")
    assert code == 0
    assert "not used: a rate of 10 1/s, since the file has times" in said
    assert "not used: the rigid body P, since only motive files have some" in said
    assert "not used: the cables A, B, since no column is of one" in said
    code, said, _ = run(capsys, "import-log", "log.csv", "--cables", "C1")
    assert (code, "not used" in said) == (0, False)
    (here / "log.csv").write_text(log.replace("time_s", "C2_length_m"))
    code, said, _ = run(capsys, *words)
    assert (code, "10 rows/s, as told" in said, "not used" in said) == (0, True, False)
