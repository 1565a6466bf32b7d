"""Pairs of engines: orders, energies of a fall, and what is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from cdpr_drake.analyses.studies import engines
from cdpr_drake.analyses.studies.study import Form
from cdpr_drake.systems.diagrams.load import load_scenario


def test_methods_have_their_orders():
    """On cables that stay taut."""
    row = engines.order_row(replace(engines.ORDERS["taut"], duration=0.1, reference=1e-4))
    assert [round(row["orders"][name]) for name in engines.METHODS] == [2, 3, 2]


def test_energies_of_a_short_fall():
    row = engines.energy_row(1e-4, 0.05)
    assert row["largest_gain"] < 0.01
    assert row["slack_cables"] == 8


def test_taut_motions_agree_and_do_not_depend_on_the_others(monkeypatch):
    monkeypatch.setattr(engines, "TAUT_DURATION", 1.0)
    row = engines.taut_row(1)
    assert row == engines.taut_row(1) != engines.taut_row(0)
    assert row["distance_m"] < 1e-6
    assert row["least_tension_n"] > 0.0
    assert engines.slack_override(3) == engines.slack_override(3) != engines.slack_override(4)


def test_a_pair_of_a_scenario_ends_alike():
    pair = engines.run_pair("planar_pbvs", ["duration=0.1"])
    assert pair["outcome_plant"] == pair["outcome_compiled"] == "timeout"
    assert pair["final_distance_m"] < 1e-6


def test_a_distance_of_states_is_of_places_and_turns():
    state = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    turned = np.array([np.cos(0.1), np.sin(0.1), 0.0, 0.0, 0.3, 0.4, 0.0])
    distance, angle = engines.state_distance(state[np.newaxis], turned[np.newaxis])
    assert distance == pytest.approx(0.5)
    assert angle == pytest.approx(0.2)


def test_every_scenario_is_one_that_both_engines_run():
    names = [case.keys.get("scenario") for case in engines.cases(Form(quick=False))]
    found = [name for name in names if name is not None]
    assert {"acrobot_pbvs", "caroca_slack_start_tca"} < set(found)
    for name in found:
        load_scenario(name, ["integration.engine=compiled"])
