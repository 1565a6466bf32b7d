"""Which engine moves a robot: what is asked for, or what suits the run."""

import pytest

from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.scenarios.run_settings import engine_of, set_engine


@pytest.mark.parametrize("name", ["acrobot_pbvs", "planar_computed_torque"])
def test_long_and_repeated_runs_take_the_compiled_engine_and_say_so(name):
    short = load_scenario(name, ["duration=600"])
    assert set_engine(short) == (short, "")
    assert engine_of(short) == "plant"
    for chosen, words in (
        set_engine(load_scenario(name, ["duration=600.1"])),
        set_engine(short, repeated=True),
    ):
        assert engine_of(chosen) == chosen.integration.engine == "compiled"
        assert words.startswith(f"{name}: by the compiled engine")


@pytest.mark.parametrize("engine", ["plant", "compiled"])
def test_what_is_asked_for_is_left(engine):
    scenario = load_scenario("acrobot_pbvs", ["duration=1e4", f"integration.engine={engine}"])
    assert set_engine(scenario, repeated=True) == (scenario, "")
    assert engine_of(scenario) == engine
