"""The examples run as they are shipped, are listed and copied."""

import json
import re
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

import cdpr_drake as cdpr
from cdpr_drake.analyses.programs import EXAMPLES as FOLDER
from cdpr_drake.analyses.programs import example_names
from cdpr_drake.cli.commands import COMMANDS, FIRST_STEPS
from cdpr_drake.systems.controllers.schemes import SCHEMES
from cdpr_drake.systems.estimators.estimator_kinds import ESTIMATORS
from cdpr_drake.tensions.methods import METHODS
from tests.cli.commands import refuse, run, told
from tests.systems.pick_and_place.test_pick_and_place import SHORT

LONG = 70
"""Lines that an example has at most, so that it is read in a minute."""

TABLES = (METHODS, SCHEMES, ESTIMATORS)
"""What examples put rows of their own into."""


def numbers(pattern, out):
    """What the groups of a pattern hold wherever it is found, shape (n, groups)."""
    found = re.findall(pattern, out)
    assert found, (pattern, out)
    return np.array(found, float).reshape(len(found), -1)


def repeats(out):
    ends = numbers(r"([\d.]+)(?=[ \]])", out.rpartition("[mm]: [")[2])
    return "4 converged" in out and len(ends) == 4 and ends.max() < 0.3


def winds_to_the_goal(out):
    away = numbers(r"s: ([\d.]+) mm away", out)[:, 0]
    return len(away) == 6 and np.all(np.diff(away) < 0.0) and away[-1] < 0.5


def converges_where_certified(out):
    shares = numbers(r"(?:pbvs|2\.5d|ibvs) +([\d.]+) +([\d.]+) +([\d.]+) +([\d.]+) +23", out)
    return len(shares) == 3 and np.all(shares[:, :3].argsort() == [2, 1, 0]) and np.all(shares > 0)


def is_proven_and_hardly_longer(out):
    straight, proven, bound, _, wrong = numbers("wall" + 5 * r", ([\d.]+)", out).T
    close = (straight < bound) & (bound <= proven * (1.0 + 1e-6)) & (proven < 1.1 * straight)
    return len(proven) == 2 and np.all(close) and not np.any(wrong)


def leaves_less_swing(out):
    ends, left, off = numbers(r"([\d.]+) +([\d.]+) +([\d.]+)\n", out).T
    plain, zvd, shot, robust = 0, 2, 4, 5
    sooner = ends[plain] < ends[shot] < ends[zvd]
    return sooner and left[shot] < left[zvd] < 0.1 * left[plain] and off[robust] < off[zvd]


def is_heavier_saved_and_asked(out):
    share = numbers(r" static +([\d.]+) ", out)[0, 0]
    there = Path("mine.yaml").is_file() and Path("mine_workspace.png").stat().st_size > 0
    return "Robot mine" in out and "1 kg, box" in out and 0.0 < share <= 100.0 and there


def is_closed_for_two_seconds(out):
    told = json.loads(Path("served/summary.json").read_text())
    assert (told["outcome"], told["sim_time_s"]) == ("completed", pytest.approx(2.0))
    off = told["position_error_m"]["max"], told["rotation_error_rad"]["max"]
    return "'outcome': 'completed'" in out and off[0] < 1e-3 and off[1] < 0.02


def changes_with_the_arm(out):
    first, _, last = re.findall(r"rad: \[([^\]]+)\] N", out)
    apart = np.array(first.split(), float) - np.array(last.split(), float)
    return np.max(np.abs(apart)) > 1.0 and "at rest: stable" in out


def learns_points(out):
    rows = dict(re.findall(r"^(.*?)  +[\d.]+ +([\d.]+) +\d+$", out, re.MULTILINE))
    path, points = rows["largest distance from the true model's path"], rows["error of the points"]
    doubts = re.findall(r": (\d) of 1 runs doubted", out)
    return float(path) < 0.8 and float(points) < 1.0 and doubts[1:] == ["1", "1"]


def costs_noise_if_known(out):
    rows = {line[:26].strip(): np.array(line[26:].split(), float) for line in out.splitlines()[1:]}
    ratios = {name: row[:3] / rows["no lens"][:3] for name, row in rows.items()}
    factors = {name: rows[name][3] for name in ("barrel, known", "fisheye, known")}
    known = all(np.all(ratios[name] < 1.02 * factor) for name, factor in factors.items())
    ignored = [ratios[name] for name in ("barrel, ignored", "fisheye, ignored")]
    return (
        known and np.min(ignored) > 5.0 and all(1.0 < factor < 1.2 for factor in factors.values())
    )


def sees_more_on_joints(out):
    seen = numbers(
        r"4 starts; the tag is seen from (\d) and kept in view from (\d); (\d) arrive", out
    )
    fixed, turned = seen[:2], seen[2:]
    return (
        np.all(turned == 4)
        and np.all(fixed < 4)
        and numbers("at most; ([\\d.]+) px", out).max() < 20
    )


def puts_the_box_down(out):
    ends = numbers(r"at most ([\d.]+) mm and ([\d.]+) deg", out)
    blind = out.rpartition("one camera")[2]
    return (
        len(ends) == 3
        and np.all(ends < (2.0, 1.0))
        and "0 of 1 boxes" in blind
        and "the tag that it needs was not seen" in blind
    )


def is_nearer_without_a_tag(out):
    rows = numbers(r"1 of 1 arrive, ([\d.]+) mm and ([\d.]+) deg off in the median", out)
    return len(rows) == 4 and np.all(rows[1:] <= 3.0 * rows[0]) and out.count("in 0 images") == 4


def one_winds_and_one_waits(out):
    heights = numbers(r"\[[\d.]+ +[\d.]+ +([\d.]+)\]", out)[:, 0]
    return heights[0] > heights[1] + 1e-3 and abs(heights[1] - 0.15) < 1e-4


SAID = {
    "adaptation": learns_points,
    "basin": converges_where_certified,
    "calibrate": lambda out: np.all(
        np.diff(numbers(r"(?:exit|anchor) points +([\d.]+) +([\d.]+)", out)) < 0.0
    ),
    "design": lambda out: len(
        numbers(r"(?:wrench-feasible|csw) +([\d.]+) +([\d.]+) +(?:m\^3|share)", out)
    ) == 2,
    "learning": lambda out: "32 of 32 at their goals, 0 lost" in out,
    "lenses": costs_noise_if_known,
    "monte_carlo": repeats,
    "own_controller": winds_to_the_goal,
    "own_estimator": lambda out: "acrobot_pbvs: converged" in out and "['X_WP_homing']" in out,
    "own_robot": is_heavier_saved_and_asked,
    "own_scheme": lambda out: (
        "weighted: " in out and np.all(numbers(r": ([\d.]+) mm off", out) < 0.3)
    ),
    "own_tension_method": lambda out: len(
        numbers(r"(?:least_norm|barycenter) +feasible +([\d.]+)", out)
    ) == 2,
    "pan_tilt": sees_more_on_joints,
    "pick_and_place": puts_the_box_down,
    "plan_and_follow": lambda out: (
        "all limits kept; steps without tensions: 0" in out and Path("plan.png").is_file()
    ),
    "process_outside": is_closed_for_two_seconds,
    "proven_paths": is_proven_and_hardly_longer,
    "robot_with_arm": changes_with_the_arm,
    "tagless": is_nearer_without_a_tag,
    "two_robots": one_winds_and_one_waits,
    "without_swing": leaves_less_swing,
}  # fmt: skip
"""What the text of each example says, of what it prints and writes. A new one has a row."""


SHORTER = {
    "adaptation": ["duration=5"],
    "pick_and_place": SHORT,
    "tagless": ["duration=8", "camera.rate=10"],
}
"""Changes that make the runs of an example shorter."""


@pytest.mark.parametrize("name", example_names())
def test_an_example_does_what_it_says_in_an_empty_folder(name, here, capfd, monkeypatch):
    simulate, shorter = cdpr.simulate, SHORTER.get(name, ())
    monkeypatch.setattr(sys, "argv", [f"{name}.py"])
    monkeypatch.setattr(
        cdpr,
        "simulate",
        lambda what, words=(), *more, **named: simulate(what, [*words, *shorter], *more, **named),
    )
    before = [dict(table) for table in TABLES]
    try:
        runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    finally:
        for table, rows in zip(TABLES, before, strict=True):
            table.clear()
            table.update(rows)
    out = capfd.readouterr().out
    assert SAID[name](out), out
    assert len((FOLDER / f"{name}.py").read_text().splitlines()) <= LONG


def test_they_are_listed_and_copied_and_nothing_is_overwritten(capsys, here):
    assert [each["name"] for each in told(capsys, "examples")] == example_names()
    code, out, _ = run(capsys, "examples", "two_robots", "--out", ".")
    assert (code, out.strip()) == (0, "two_robots.py")
    copied = here / "two_robots.py"
    assert copied.read_bytes() == (FOLDER / "two_robots.py").read_bytes()
    copied.write_text("mine")
    assert "never overwritten" in refuse(capsys, "examples", "all", "--out", ".")
    assert [path.name for path in here.iterdir()] == ["two_robots.py"]
    assert copied.read_text() == "mine"


def test_groups_have_every_subcommand_once_with_examples_of_itself():
    groups = [command.group for command in COMMANDS.values()]
    assert groups == sorted(groups, key=groups.index)  # groups are not torn apart
    examples = [line for command in COMMANDS.values() for line in command.examples]
    assert len(set(examples)) == len(examples)
    for name, command in COMMANDS.items():
        assert len(command.examples) >= 2
        assert all(line.split()[:2] == ["cdpr", name] for line in command.examples)


def test_the_command_alone_shows_first_steps(capsys):
    code, out, _ = run(capsys)
    assert code == 0
    for line, words in FIRST_STEPS.items():
        assert line in out
        assert words in out
        assert line.split()[1] in COMMANDS
