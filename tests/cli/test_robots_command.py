"""`cdpr robots`: filters, and the page of pictures."""

import errno
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from cdpr_drake.analyses.visualization.robot_gallery import thumbnail
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import load_robot, robot_names
from tests.messages import printed


def ask(*options):
    with pytest.raises(SystemExit) as ended:
        main(["robots", *options])
    return ended.value.code


@pytest.fixture(scope="module")
def every_robot():
    return {name: load_robot(name) for name in robot_names()}


@pytest.fixture
def library(monkeypatch, every_robot):
    """The files are read once."""
    monkeypatch.setattr("cdpr_drake.cli.robots.load_robot", every_robot.get)


@pytest.mark.parametrize(
    ("options", "some", "others"),
    [
        (["--motion", "2t1r"], {"planar", "kntu_planar"}, {"caroca", "fast"}),
        (["--cables", "10"], {"segesta"}, {"caroca", "planar"}),
        (["--cables", "9-"], {"segesta"}, {"cogiro"}),
        (["--cables", "-4"], {"planar"}, {"fast"}),
        (["--cables", "6-8"], {"fast", "cogiro"}, {"segesta", "planar"}),
        (["--suspended"], {"cogiro", "fast", "caroca"}, {"ipanema_1", "planar", "macarm"}),
        (["--not-suspended", "--cables", "8"], {"ipanema_1", "macarm"}, {"cogiro", "planar"}),
        (["--underactuated"], {"grab_three", "grab_four"}, {"spider_camera", "fast"}),
        (["--motion", "3T", "--suspended"], {"spider_camera"}, {"planar_point", "cogiro"}),
        (["--camera"], {"acrobot_small"}, {"fast"}),
        (["--search", "IPAnema"], {"ipanema_1", "ipanema_2", "ipanema_3"}, {"fast"}),
    ],
)
def test_filters(capsys, library, options, some, others):
    assert ask(*options, "--json") == 0
    found = {robot["name"] for robot in json.loads(printed(capsys).out)}
    assert some <= found
    assert not others & found


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--motion", "9R"], r"--motion: found '9R'; accepted: .*3R3T"),
        (["--cables", "many"], r"--cables: found 'many'; accepted: such as 8"),
        (["--cables", "-"], r"--cables: found '-'"),
        (["--cables", "99"], r"found no robot with all of these"),
        (["--gallery", "page.txt"], r"--gallery: found page.txt; accepted: .* \.html"),
        (["--gallery", "no/such/page.html"], r"found no folder"),
    ],
)
def test_what_is_refused(capsys, monkeypatch, tmp_path, options, words):
    monkeypatch.chdir(tmp_path)
    assert ask(*options) == 2
    (line,) = printed(capsys).err.splitlines()
    assert re.search(words, line)
    assert not list(tmp_path.iterdir())


def test_gallery(capsys, tmp_path):
    page = tmp_path / "robots.html"
    assert ask("--gallery", str(page), "--cables", "4-") == 0
    assert printed(capsys).out.strip() == str(page)
    words = page.read_text(encoding="utf-8")
    for name in robot_names():
        assert (f"<h2>{name}</h2>" in words) == (len(load_robot(name).cables) >= 4)
    assert not re.search(r"<script|https?:|url\(|@import", words)  # nothing is fetched


def test_a_page_that_cannot_be_finished_leaves_nothing(capsys, monkeypatch, tmp_path):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    page = tmp_path / "robots.html"
    page.write_text("before")
    monkeypatch.setattr(Path, "replace", full)
    assert ask("--gallery", str(page)) == 2
    assert "No space left" in printed(capsys).err
    assert page.read_text() == "before"
    assert list(tmp_path.iterdir()) == [page]


@pytest.mark.parametrize("name", ["caroca", "planar"])
def test_thumbnail_has_all_cables_in_true_proportions(name):
    robot = load_robot(name)
    svg = ElementTree.fromstring(thumbnail(robot))
    paths = [path for path in svg.iter("path") if path.get("class") == "cable"]
    assert len(paths) == len(robot.cables)
    ends = np.array([re.findall(r"-?\d+\.\d", path.get("d")) for path in paths], float)
    if robot.is_planar():  # seen from above, so that lengths in the plane are to scale
        cables, X_WP = robot.cable_set(), robot.home.transform()
        true = np.linalg.norm(cables.p_WA - X_WP.multiply(cables.p_PB), axis=0)
        drawn = np.linalg.norm(ends[:, 2:] - ends[:, :2], axis=1)
        np.testing.assert_allclose(drawn / drawn[0], true / true[0], rtol=0.01)
    assert np.all((ends >= 0.0) & (ends <= 280.0))
