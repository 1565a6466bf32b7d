"""`cdpr simulate --compare-reactions`: what it prints, writes and refuses."""

import json

import pytest

import cdpr_drake as cdpr
from cdpr_drake.cli.app import main
from tests.messages import printed

ENGINE = "integration.engine=compiled"
COMPARE = [
    "simulate", "acrobot_broken_redistributed", "--compare-reactions", "5", "--break-time", "0.3",
    "--after", "0.3", "--reactions", "none,stop", "--set", ENGINE,
]  # fmt: skip


def ended(arguments):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    return end.value.code


def test_it_prints_what_the_call_says(capsys, tmp_path):
    assert ended([*COMPARE, "--json", "--out", str(tmp_path / "found")]) == 0
    told = json.loads(printed(capsys).out)
    same = cdpr.compare_reactions(
        cable=5, time=0.3, after=0.3, reactions=("none", "stop"), overrides=[ENGINE]
    )
    assert told == same.as_dict()
    assert json.loads((tmp_path / "found" / "results.json").read_text()) == told
    assert (tmp_path / "found" / "reactions.png").is_file()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--duration", "3"], "--duration: accepted without --compare-reactions"),
        (["--seeds", "0:3"], "--seeds: accepted without --compare-reactions"),
        (["--reactions", "pray"], "--reactions: found 'pray'; accepted: none, stop"),
        (["--break-time", "0"], "--break-time: found 0; accepted: a number > 0"),
    ],
)
def test_what_is_refused(more, words, capsys):
    assert ended([*COMPARE, *more]) == 2
    assert words in printed(capsys).err


def test_its_options_are_refused_without_it(capsys):
    assert ended(["simulate", "acrobot_pbvs", "--after", "1"]) == 2
    assert "--after: accepted with --compare-reactions only" in printed(capsys).err
