"""`cdpr doctor --compile` does every step and says which."""

import json

import pytest

from cdpr_drake import cli
from cdpr_drake.analyses.installation import LISTED, compilation_steps
from cdpr_drake.kernel_cache.kernel_list import group_names
from cdpr_drake.systems.scenarios.files import scenario_names
from tests.messages import printed


def code_of(arguments):
    with pytest.raises(SystemExit) as ended:
        cli.main(arguments)
    return ended.value.code


def test_every_step_is_done_and_named(capsys, monkeypatch):
    done = []
    steps = [(name, lambda name=name: done.append(name)) for name in ("one", "two")]
    for module in ("analyses.installation", "cli.doctor"):
        monkeypatch.setattr(f"cdpr_drake.{module}.compilation_steps", lambda: steps)
    monkeypatch.setattr("cdpr_drake.analyses.installation.compile_needed", done.append)
    assert code_of(["doctor", "--compile", "--json"]) == 0
    found = json.loads(printed(capsys).out)
    assert done == [group_names(), "one", "two"]
    assert found["steps"] == [LISTED, "one", "two"]
    assert found["wall_time_s"] >= 0.0
    assert code_of(["doctor", "--compile"]) == 0
    assert "Kernels are compiled and kept" in printed(capsys).err


def test_the_steps_are_all_scenarios_and_both_engines_of_the_default():
    names = [name for name, _ in compilation_steps()]
    assert set(scenario_names()) < set(names)
    assert {"tension methods", "acrobot_pbvs, compiled engine"} < set(names)
    assert names[1] == "acrobot_pbvs"
    dict(compilation_steps())["tension methods"]()
    dict(compilation_steps())["acrobot_pbvs"]()
