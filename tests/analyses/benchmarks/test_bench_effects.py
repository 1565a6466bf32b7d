"""The closed loops with physical effects run, and their rows say what they measured."""

from cdpr_drake.analyses.benchmarks.simulation import EFFECTS, effect_rows
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario


def test_rows_are_real_time_factors():
    rows = effect_rows(quick=True)
    assert len(rows) == len(EFFECTS)
    for row in rows:
        assert row.ratio > 0.0
        assert abs(row.ratio - row.baseline_value / row.value) < 1e-9 * row.ratio


def test_names_say_what_is_on():
    for name, (scenario, overrides) in EFFECTS.items():
        loaded = load_scenario(scenario, list(overrides))
        assert ("pulleys" in name) == loaded.cables.pulleys
        model = loaded.cables.model_of(load_robot(loaded.robot))
        assert ("catenary" in name) == (model == "catenary")
        assert ("friction" in name) == (loaded.winches.kind == "motor")
