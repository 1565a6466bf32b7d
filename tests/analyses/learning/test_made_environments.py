"""Environments by the front door and by the command."""

import json
import sys

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.benchmarks.learning import learning_rows
from cdpr_drake.cli.app import main
from cdpr_drake.errors import CdprError
from cdpr_drake.gym import STEPS
from tests.analyses.benchmarks.once import without_repeats
from tests.messages import printed


def run(capsys, *words):
    try:
        main(["environments", *words])
        code = 0
    except SystemExit as ended:
        code = ended.code or 0
    return code, printed(capsys)


def test_names_are_those_of_gymnasium():
    assert cdpr.environment_names() == [f"cdpr/{name}-v0" for name in STEPS]


def test_one_and_many_by_short_and_long_name():
    env = cdpr.make_environment("Reach", action="twist")
    envs = cdpr.make_environment("cdpr/Reach-v0", 3, action="twist")
    one, many = env.reset(seed=5)[0], envs.reset(seed=5)[0]
    assert many.shape == (3, *one.shape)
    np.testing.assert_array_equal(many[0], one)


@pytest.mark.parametrize(
    ("name", "how", "words"),
    [
        ("Reech", {}, "Reach"),
        ("Reach", {"count": 0}, "count: found 0; accepted: 1 or more"),
        ("Reach", {"speed": 1.0}, "option 'speed'"),
    ],
)
def test_what_cannot_be_made(name, how, words):
    with pytest.raises(CdprError, match=words):
        cdpr.make_environment(name, **how)


def test_without_gymnasium_it_says_what_to_install(monkeypatch):
    monkeypatch.delitem(sys.modules, "cdpr_drake.gym", raising=False)
    monkeypatch.setitem(sys.modules, "gymnasium.envs.registration", None)
    with pytest.raises(CdprError, match="pip install"):
        cdpr.environment_names()


def test_the_command_lists_them_and_draws_one(capsys, tmp_path):
    code, (out, _) = run(capsys, "--json", "--robot", "caroca")
    found = json.loads(out)
    assert (code, [one["name"] for one in found]) == (0, cdpr.environment_names())
    assert {one["robot"] for one in found} == {"caroca"}
    picture = tmp_path / "reach.png"
    code, (out, _) = run(capsys, "Reach", "--picture", str(picture))
    assert code == 0
    assert "cdpr/Reach-v0" in out
    assert picture.stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("Reech",), "Reach"),
        (("--picture", "all.png"), "accepted: a .png of one"),
        (("Reach", "--picture", "reach.txt"), "accepted: a .png of one"),
        (("Reach", "--action", "pull"), "action: found 'pull'"),
        (("Reach", "--picture", "none/reach.png"), "none/reach.png: cannot be written"),
    ],
)
def test_bad_input_is_told_in_one_line(capsys, tmp_path, monkeypatch, words, told):
    monkeypatch.chdir(tmp_path)
    code, (out, err) = run(capsys, *words)
    assert (code, out) == (2, "")
    assert told in err
    assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_benchmarks_compare_every_task(monkeypatch):
    without_repeats(monkeypatch)
    rows = learning_rows(quick=True)
    assert [row.as_dict()["name"].split(",")[0] for row in rows] == cdpr.environment_names()
