"""The study of engines: what it runs, what it states, that it stops and goes on."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import CONFIRMED, NOT_CONFIRMED
from cdpr_drake.analyses.studies.engines import study as module
from cdpr_drake.analyses.studies.engines.pairs import COLUMNS, OrderTask, TautTask, slack_override
from cdpr_drake.analyses.studies.engines.statements import engine_statements, orders
from cdpr_drake.analyses.studies.engines.study import study_engines
from cdpr_drake.systems.monitoring.run_monitor import Outcome


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The quick form without its servos of full length, stopped once and continued."""
    with pytest.MonkeyPatch.context() as patch:
        tasks = module._tasks
        left_out = {"impacts"}
        patch.setattr(
            module,
            "_tasks",
            lambda quick: {k: task for k, task in tasks(quick).items() if k not in left_out},
        )
        patch.setattr(module, "QUICK_MOTIONS", 1)
        patch.setattr(module, "QUICK_SCENARIOS", ("acrobot_pbvs", "planar_computed_torque"))
        folder = tmp_path_factory.mktemp("study")
        asked = []

        def stop():
            asked.append(0)
            return len(asked) > 1

        first = study_engines(True, StudySession(folder, should_stop=stop, workers=1))
        assert first.interrupted
        assert first.found
        return study_engines(True, StudySession(folder, workers=1))


def test_it_continues_where_it_stopped(study):
    assert not study.interrupted
    assert study.progress.found > 0


def test_methods_have_their_orders_and_taut_motions_agree(study):
    found = {s.words: s for s in study.statements()}
    (taut,) = [s for words, s in found.items() if words.startswith("While cables stay taut")]
    (order,) = [s for words, s in found.items() if words.startswith("Methods have")]
    (shipped,) = [s for words, s in found.items() if words.startswith("Every scenario")]
    (energy,) = [s for words, s in found.items() if words.startswith("At real stiffness")]
    (steps,) = [s for words, s in found.items() if words.startswith("How far they part")]
    for statement in (taut, order, shipped, energy, steps):
        assert statement.verdict == CONFIRMED, statement


def test_results_and_figure_are_written(study, tmp_path):
    study.write(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"results.json", "engines.png"}
    found = json.loads((tmp_path / "results.json").read_text())
    assert found["columns"] == list(COLUMNS)
    assert len(found["results"]["scenario acrobot_pbvs"]["pairs"][0]) == len(COLUMNS)
    assert study.tables()


def pair(**changes):
    row = dict.fromkeys(COLUMNS, 0.0)
    row |= {"outcome_plant": Outcome.CONVERGED, "outcome_compiled": Outcome.CONVERGED}
    return np.array([list((row | changes).values())], float)


def test_engines_that_part_are_told_so():
    bad = {
        "taut motions": {"taut": np.array([[2e-6, 0.0, 0.0, 1.0]])},
        "scenario a": {"pairs": pair(outcome_compiled=Outcome.TIMEOUT)},
        "impacts": {"pairs": pair(final_error_compiled_m=1e-3)},
        "order taut": {"distance": np.ones((1, 2, 3)) * [[2.0], [1.0]]},
        "order catching": {"distance": np.ones((1, 2, 3))},
        "order catching real": {"distance": np.ones((1, 2, 3))},
        "energy": {"energy": np.array([[0.5, -0.1, 0.0, 3.0, 1.0]])},
    }
    statements = engine_statements(bad)
    assert len(statements) == len(bad) - 1
    assert {statement.verdict for statement in statements} == {NOT_CONFIRMED}


def test_an_order_is_that_of_a_power():
    distance = np.array([OrderTask().steps()]).T ** np.array([[1.0, 2.0, 3.0]])
    np.testing.assert_allclose(orders(distance), [1.0, 2.0, 3.0])


def test_an_item_does_not_depend_on_the_others():
    np.testing.assert_array_equal(TautTask()(0, 2)["taut"][1], TautTask()(1, 2)["taut"][0])
    assert slack_override(3) == slack_override(3) != slack_override(4)


def test_it_stops_when_asked():
    stopped = study_engines(True, StudySession(workers=1, should_stop=lambda: True))
    assert stopped.interrupted
    assert stopped.as_dict()["statements"] == []
