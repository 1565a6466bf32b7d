"""The study of the mobile robot: its quick form, and its judges on laps that are made up."""

import json

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import (
    CONFIRMED,
    IN_PART,
    NOT_CONFIRMED,
    evaluate_checks,
)
from cdpr_drake.analyses.studies.mobile_robot.configurations import (
    PUBLISHED_LAPS,
    VARIED,
    VARIED_ESTIMATORS,
    configurations,
)
from cdpr_drake.analyses.studies.mobile_robot.figures import FIGURES
from cdpr_drake.analyses.studies.mobile_robot.judges import CHECKS
from cdpr_drake.analyses.studies.mobile_robot.laps import (
    COLUMNS,
    PHASES,
    LapsTask,
    _with_friction,
    times_beyond,
)
from cdpr_drake.analyses.studies.mobile_robot.slack_statements import CORNERS, at_one_place
from cdpr_drake.analyses.studies.mobile_robot.statements import laps_words, rises
from cdpr_drake.analyses.studies.mobile_robot.study import study_mobile_robot
from cdpr_drake.cli.app import main
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from tests.messages import printed


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """The quick form and its folder."""
    folder = tmp_path_factory.mktemp("study") / "mobile-robot"
    return study_mobile_robot(quick=True, session=StudySession(folder, workers=1)), folder


def test_the_quick_form_follows_for_two_laps_and_is_written(quick):
    result, folder = quick
    assert not result.interrupted
    names = {"estimator cable_lengths", "plain", "corrected"}
    assert set(result.found) == names
    for arrays in result.found.values():
        assert arrays["end"].tolist() == [[float(Outcome.TIMEOUT), pytest.approx(2.0)]]
        assert np.all(np.isfinite(arrays["sums"]))
        assert arrays["sums"].shape == (1, 2, PHASES)
        assert arrays["paths"].shape == (1, 4, PHASES, 3)
        assert arrays["tensions"].shape == (1, 6, PHASES, 8)
        seen = arrays["laps"][0, :, COLUMNS.index("seen")]
        assert seen[1] == 1.0
    result.write(folder)
    drawn = {path.stem for path in folder.glob("*.png")}
    assert {"paths_plain", "paths_corrected", "lengths_by_lap"} <= drawn <= set(FIGURES)
    assert {"results.json", "mobile_robot.png", "parts.npz"} <= {p.name for p in folder.iterdir()}
    stored = json.loads((folder / "results.json").read_text())
    assert stored["seeds"] == [0]
    assert [c["name"] for c in stored["configurations"]] == [c.name for c in result.shown()]
    assert "lap_time" in stored["scenario"]
    unclear = [s for s in stored["statements"] if "judging failed" in s["found"] + s["words"]]
    assert unclear == []  # what takes more laps is left to the full form
    assert not any("nan" in said["found"] for said in stored["statements"])
    again = study_mobile_robot(quick=True, session=StudySession(folder, workers=1))
    assert again.progress.found == 3  # nothing is run twice
    assert len(again.tables()) == 2


def test_every_configuration_is_a_scenario_that_is_accepted(tmp_path):
    full = configurations(quick=False)
    assert len(full) == len(PUBLISHED_LAPS) + 2 + 4 * len(VARIED)
    for configuration in full:
        load_scenario("acrobot_mobile_robot", configuration.task.changes)
    file = _with_friction(tmp_path, 3.0)
    changed, robot = load_robot(str(file)), load_robot("acrobot_large")
    assert changed.winch.friction.coulomb == 3.0 * robot.winch.friction.coulomb
    assert LapsTask((), 1).friction == 1.0


SHAPE = {
    "most_slack": 1.0, "seen": 1.0, "path_m": 0.001, "tension_n": 9.0, "estimate_rad": 0.26,
    "one_slack": 0.8, "two_slack": 1.0, "underactuated_s": 1.0, "at_threshold": 1.5,
    "estimate_at": 0.5, "slack_at_estimate": 3.0, "path_at": CORNERS[1] + 0.05,
}  # fmt: skip
"""A lap as the thesis has them."""


def made_up(laps, failed_at=None, high=0.0, growth=0.0, **other):
    """Arrays of one run that ends after `failed_at` laps."""
    done = laps if failed_at is None else failed_at
    table = np.full((1, laps, len(COLUMNS)), np.nan)
    rows = np.arange(laps) < done
    for name, value in (SHAPE | other).items():
        table[0, rows, COLUMNS.index(name)] = value
    for name in ("estimate_m", "estimate_z_m"):
        table[0, rows, COLUMNS.index(name)] = high * (1 + np.flatnonzero(rows))
    sums = np.full((1, laps, PHASES), np.nan)
    sums[0, rows] = 8.5 + growth * np.flatnonzero(rows)[:, None]
    outcome = Outcome.TIMEOUT if failed_at is None else Outcome.TARGET_LOST
    return {
        "end": np.array([[float(outcome), float(done)]]), "laps": table, "sums": sums,
        "paths": np.zeros((1, 4, PHASES, 3)), "tensions": np.full((1, 6, PHASES, 8), 5.0),
        "underactuated_at_end": np.array([[6.0 if failed_at else 0.0]]),
    }  # fmt: skip


def verdicts(found):
    return [statement.verdict for statement in evaluate_checks(CHECKS, found)]


def published():
    """Runs as the thesis has them."""
    found = {f"estimator {kind}": made_up(30, laps) for kind, laps in PUBLISHED_LAPS.items()}
    found["estimator control_integration"] = made_up(30, 12, high=0.025)
    found["estimator cable_lengths_elastic_pulleys"] = made_up(30, 4, high=0.03)
    found["plain"] = made_up(60, 29, growth=0.02)
    path = found["plain"]["laps"][0, :, COLUMNS.index("path_m")]
    path[15:22], path[22:29] = 0.05, 0.1
    found["corrected"] = made_up(700)
    found["corrected"]["laps"][0, 0, COLUMNS.index("path_m")] = 0.005
    for name in VARIED:
        found[f"{name}, plain"], found[f"{name}, corrected"] = made_up(60, 20), made_up(60)
        for kind in VARIED_ESTIMATORS:
            found[f"{name}, estimator {kind}"] = made_up(30, PUBLISHED_LAPS[kind])
    return found


def test_what_is_published_is_confirmed_and_its_contrary_is_not():
    found = published()
    assert len(verdicts(found)) == 25
    assert {s.words: s.verdict for s in evaluate_checks(CHECKS, found)
            if s.verdict != CONFIRMED} == {}  # fmt: skip

    found["corrected"] = made_up(700, 40, most_slack=3.0, at_threshold=0.0)
    found["corrected"]["tensions"][:, -1] += 5.0
    found["plain"] = made_up(60, one_slack=0.1, two_slack=0.1, underactuated_s=0.0)
    for kind in PUBLISHED_LAPS:
        found[f"estimator {kind}"] = made_up(30)
        found[f"estimator {kind}"]["laps"][0, :, COLUMNS.index("estimate_at")] = np.arange(30) / 30
    for name in VARIED:
        found[f"{name}, corrected"] = made_up(60, 20)
        for kind in VARIED_ESTIMATORS:
            found[f"{name}, estimator {kind}"] = made_up(30)
    assert set(verdicts(found)) <= {NOT_CONFIRMED, IN_PART}
    assert verdicts({"plain": made_up(2), "corrected": made_up(2)})  # laps are missing, no error


def test_corners_phases_and_times():
    motion = load_scenario("acrobot_mobile_robot").target.path()
    for k, phase in enumerate(CORNERS):
        x_ahead = motion.at(16.0 * phase).rotation().matrix()[:2, 0]
        heading = np.degrees(np.arctan2(x_ahead[1], x_ahead[0]))
        turned = heading - np.degrees(np.arctan2(*motion.at(0.0).rotation().matrix()[1::-1, 0]))
        assert (turned - 45.0 - 90.0 * k + 180.0) % 360.0 == pytest.approx(180.0, abs=1.0)
    assert at_one_place(np.array([0.2, 0.3, np.nan])) == (
        pytest.approx(0.25), pytest.approx(np.cos(0.1 * np.pi)),
    )  # fmt: skip
    times, beyond = np.arange(5.0), np.array([False, True, True, False, True])
    assert times_beyond(times, beyond).tolist() == [0.0, 1.0, 2.0, 0.0, 1.0]
    assert times_beyond(times, np.ones(5, bool))[-1] == 4.0


def test_words_and_rises():
    ends = np.array([[3.0, 20.0], [2.0, 4.0], [2.0, 6.0]])
    assert laps_words(ends) == "median 6.0 (4.0 to 20.0), 1 of 3 did not fail"
    sums = made_up(30, 25, growth=0.01)["sums"]
    assert rises(sums, 10, 20) == pytest.approx(0.1)
    assert np.isnan(rises(sums, 10, 28))
    assert np.isnan(rises(sums, 10, 40))


def test_seeds_are_refused_by_studies_that_do_not_repeat(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["study", "scenarios", "--quick", "--seeds", "3"])
    assert ended.value.code == 2
    said = printed(capsys).err
    assert "--seeds: accepted with" in said
    assert "case-*, not with scenarios" in said
