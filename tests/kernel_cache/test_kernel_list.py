"""The list of kernels names what exists, and commands ask for groups that it has."""

import sys
from io import StringIO

import pytest

from cdpr_drake.analyses.installation import compilation_steps
from cdpr_drake.analyses.reporting.written_files import MARKER
from cdpr_drake.cli import process as first_use
from cdpr_drake.cli.commands import COMMANDS
from cdpr_drake.kernel_cache.kernel_list import group_names, missing_kernels, needed_kernels
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO
from tests.record_kernels import signature_words

DEFAULT = [DEFAULT_SCENARIO]


def test_its_groups_are_what_commands_ask_for():
    assert group_names() == first_use.GROUPS
    assert first_use.DEFAULT == DEFAULT_SCENARIO
    assert first_use.COMPILED in dict(compilation_steps())
    assert set(first_use.QUESTIONS) <= set(COMMANDS)


def test_its_kernels_exist_and_follow_those_that_they_call():
    kernels = needed_kernels(group_names())
    for kernel in kernels:
        assert max(kernel.calls, default=-1) < kernel.number
        assert kernel.dispatcher().py_func.__module__.startswith("cdpr_drake.")
        assert signature_words(kernel.types()) == kernel.signature
    assert len(needed_kernels(DEFAULT)) > 40
    for group in group_names():
        kernels = needed_kernels([group])
        numbers = {kernel.number for kernel in kernels}
        assert all(kernel.calls <= numbers for kernel in kernels), group


def test_a_question_about_stability_compiles_nothing_of_moved_objects():
    names = {kernel.name for kernel in needed_kernels(["stability"])}
    gradients = "stability.criterion_gradient_kernel:"
    assert f"{gradients}gradient_known_object" in names
    assert not names & {f"{gradients}gradient", f"{gradients}_add_object_gradient"}


@pytest.mark.parametrize(
    ("line", "groups"),
    [
        ("simulate", DEFAULT),
        ("simulate mine.yaml --camera projected", DEFAULT),
        ("serve acrobot_ibvs", DEFAULT),
        ("simulate --seeds 0:9", [*DEFAULT, first_use.COMPILED]),
        ("simulate --set integration.engine=compiled", [*DEFAULT, first_use.COMPILED]),
        ("studio", DEFAULT),
        ("doctor --compile", None),
        ("tension acrobot_small", ["tension"]),
        ("static --json acrobot_small", ["static"]),
        ("workspace planar --kind dynamic", ["workspace"]),
        ("workspace caroca --kind dynamic-single-failure", [first_use.BROKEN]),
        ("workspace --kind=static,dynamic-single-failure", ["workspace", first_use.BROKEN]),
        ("workspace acrobot_large", ["workspace"]),
        ("stability", ["stability"]),
        ("plan mine.yaml --path way.csv", ["plan"]),
        ("tension planar@C1=0.3 --out new", ["tension"]),
        ("tension no_such_robot", None),
        ("plan mine.yml --limits 1,60", None),
        ("workspace planar --out others", None),
        ("workspace planar --out=others/file", None),
        ("workspace planar --out ours", ["workspace"]),
        ("simulate --out others", None),
        ("plan --help", None),
        ("simulate --help", None),
        ("doctor", None),
        ("robots", None),
        ("", None),
    ],
)
def test_a_command_asks_for_what_it_needs(line, groups, monkeypatch, tmp_path):
    for name in ("others/file", "mine.yaml", f"ours/{MARKER}"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    asked = [None]
    monkeypatch.setattr(
        first_use, "compile_in_background", lambda *given: asked.append(list(given[0]))
    )
    first_use.compile_ahead(line.split())
    assert asked[-1] == groups
    assert set(groups or []) <= set(group_names())


def keep(folder, kernels):
    """Index files as numba has them, empty: of the names alone."""
    for name in {kernel.name for kernel in kernels}:
        module, _, function = name.partition(":")
        room, _, file = module.rpartition(".")
        (folder / f"{room}_0123").mkdir(exist_ok=True)
        (folder / f"{room}_0123" / f"{file}.{function}-12.py311.nbi").touch()


def test_a_first_use_is_told_at_once_with_what_is_missing(tmp_path, monkeypatch):
    stream = StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(first_use, "compile_in_background", lambda _: 0)
    monkeypatch.setattr(first_use, "_expected", 0)
    kernels = needed_kernels(["tension"])
    names = len({kernel.name for kernel in kernels})
    assert missing_kernels(["tension"]) == names > 5
    first_use.compile_ahead(["tension", "planar"])
    said = f"progress: first use of cdpr tension: compiling up to {names} kernels, which are kept\n"
    assert stream.getvalue() == said
    assert first_use.expected_kernels() == names
    keep(tmp_path, kernels)
    assert missing_kernels(["tension"]) == 0
    first_use.compile_ahead(["tension", "planar"])
    assert stream.getvalue() == said
