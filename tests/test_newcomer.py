"""What the newcomer is given parses; a short chain runs; the script sees what goes wrong.

All of it is played by `python -m tests.newcomer`, which takes many minutes.
"""

import os
import shlex
import sys
from pathlib import Path

import pytest

from cdpr_drake.cli.call import parsed
from cdpr_drake.cli.commands import COMMANDS as SUBCOMMANDS
from tests.newcomer import ROOT, Played, Player, Step, all_steps, page_steps, problem_of, table

TEXTS = {
    str(path.relative_to(ROOT)): path.read_text()
    for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
}
COMMANDS = sorted(
    {
        step.words
        for step in [
            *all_steps(), *(step for page, text in TEXTS.items() for step in page_steps(page, text))
        ]
        if step.subcommand()
    }
)  # fmt: skip
"""Commands of README, of the whole site, and of what is played besides."""


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_commands_of_all_pages_parse(name):
    for line in COMMANDS:
        program, *words = shlex.split(line)
        assert program == "cdpr"
        if words[0] == name:
            assert parsed(words)


def test_every_command_is_one_of_the_table():
    assert {shlex.split(line)[1] for line in COMMANDS} <= {*SUBCOMMANDS, "completion"}


def test_a_page_is_taken_apart():
    text = (
        "```sh\npython3 -m venv .venv && .venv/bin/pip install . && .venv/bin/cdpr simulate\n```\n"
        "```sh\ncdpr robots   # all of them\ncdpr new robot \\\n    mine\n```\n"
        "```python\na = 1\n```\nwords\n```python\nprint(a)\n```\n"
        "```sh\n.venv/bin/pip install -e '.[docs]' && .venv/bin/mkdocs build\n```\n"
    )
    steps = list(page_steps("page.md", text))
    told = [step.words for step in steps]
    assert told[:3] == ["cdpr simulate", "cdpr robots", "cdpr new robot mine"]
    assert (len(told), steps[3].program) == (4, "a = 1\n\nprint(a)\n")


def test_a_short_chain_runs_and_what_fails_is_seen(tmp_path):
    page = "```sh\ncdpr new robot gantry --from acrobot_large\ncdpr check gantry.yaml\n```\n"
    page += '```python\nprint("outcome: timeout")\n```\n```sh\ncdpr chek gantry.yaml\n```\n'
    # Steps and what is said of them are looked at, not how long a first use takes.
    player = Player(Path(sys.prefix), tmp_path, cache=Path(os.environ["NUMBA_CACHE_DIR"]))
    made, checked, missing, program = map(player.play, page_steps("page", page))
    assert (made.problem, checked.problem) == ("", "")
    assert checked.processor > 0.0
    assert missing.problem.startswith("exit code 2: ")
    assert "chek" in missing.problem
    assert program.problem == 'a run ends by "timeout"'
    assert "4 steps, 2 failed" in table([made, checked, missing, program])


def test_a_program_that_does_not_end_is_stopped(tmp_path):
    step = Step(page="page", words="programs of page", program="import time\ntime.sleep(600)\n")
    played = Player(Path(sys.prefix), tmp_path, patience=0.5).play(step)
    assert played.problem == "not over after 0.5 s"


@pytest.mark.parametrize(
    ("words", "out", "err", "why"),
    [
        ("cdpr simulate", "acrobot_pbvs: timeout\n", "", "timeout"),
        ("cdpr simulate --json", '  "outcome": "timeout",\n', "", "timeout"),
        ("cdpr check a.yaml", "", "cdpr: a.yaml: x: unknown key; known: y", "unknown key"),
        ("cdpr scenarios", "acrobot_moving_tag: timeout\n", "", ""),
        ("cdpr serve acrobot_pbvs --timeout 3", "acrobot_pbvs: converged", "", ""),
    ],
)
def test_what_counts_as_a_problem(words, out, err, why):
    found = problem_of(Step(page="page", words=words), 0, out, err)
    assert why in found
    assert bool(found) == bool(why)


def test_what_takes_hours_is_named_and_not_played(tmp_path):
    played = Player(Path(sys.prefix), tmp_path).play(Step(page="p", words="cdpr reproduce --quick"))
    assert isinstance(played, Played)
    assert "hours" in played.left_out
    assert "not played: a quarter of an hour" in table([played])


def test_a_step_that_names_an_extra_is_played_again_with_it(tmp_path, monkeypatch):
    missing = "raise SystemExit(\"no zmq; pip install '.[bridge]'\")\n"
    program = f"import os\nif not os.path.exists('has_it'):\n    {missing}"
    step = Step(page="page", words="programs of page", program=program)
    assert "no zmq" in Player(Path(sys.prefix), tmp_path / "as_it_is").play(step).problem
    program = tmp_path / "bin" / "python"
    program.parent.mkdir()
    program.write_text(
        "#!/bin/sh\n"
        f'[ "$1" = -m ] || exec {sys.executable} "$@"\n'
        f'touch "{tmp_path}/page/has_it" && echo "$@" > "{tmp_path}/said"\n'
    )
    program.chmod(0o755)
    played = Player(tmp_path, tmp_path, clone=Path("clone")).play(step)
    assert (played.problem, played.extra) == ("", "bridge")
    assert (tmp_path / "said").read_text() == "-m pip install -q clone[bridge]\n"
    assert "with the extra bridge" in table([played])
