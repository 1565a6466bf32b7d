"""Stability workspaces in several ways: what is asked, judges of made-up rows, pictures."""

import numpy as np
import pytest

from cdpr_drake.analyses.reporting.statements import CONFIRMED, IN_PART, NOT_CONFIRMED
from cdpr_drake.analyses.studies.framework.runs import Run, Runs
from cdpr_drake.analyses.studies.framework.study import Form
from cdpr_drake.analyses.studies.stability_bounds import figures
from cdpr_drake.analyses.studies.stability_bounds import questions as asked
from cdpr_drake.analyses.studies.stability_bounds import statements as said
from cdpr_drake.analyses.studies.stability_bounds.study import STUDY, costs_table, shares_table
from cdpr_drake.stability.perturbation_bounds import PerturbationBounds
from cdpr_drake.stability.verdict import judge_stability
from tests.figure_faults import figure_faults

QUICK = {case.name: case for case in asked.cases(Form(quick=True))}

EXACT = 1e-9
"""Of rotations and places that are added and taken away again."""

K = 3
"""Loops of a made-up pose: two drawn, one worst."""


def case_of(robot, scale):
    return QUICK[f"{robot}, D_b times {scale:g}"]


def arrays(robot, scale, **changed):
    """Everything stable at D_b / 4; the simple proofs prove nothing at D_b."""
    count = case_of(robot, scale).items
    simple = np.full(count, scale < asked.THESIS)
    found = {name: np.ones(count, bool) for name in asked.METHODS}
    found |= {"lipschitz": simple, "interval": simple, "unstable": np.zeros(count, bool)}
    found |= {"arrived": np.ones((count, K), bool), "falls": np.full((count, K), 0.5)}
    found |= {"contradicts": np.zeros((count, K), bool)}
    for name, change in changed.items():
        found[name] = np.array(found[name])
        found[name][0] = change
    return found


def made_up(robot="caroca", scale=asked.THESIS, **changed):
    """All rows, with something changed at the first pose of a robot under some bounds."""
    rows = []
    for one in asked.ROBOTS:
        for s in asked.QUICK_SCALES:
            case = case_of(one, s)
            here = changed if (one, s) == (robot, scale) else {}
            row = asked.reduce(case, arrays(one, s, **here))
            rows.append(Run(case.name, None, case.keys, row, {}))
    for n, one in enumerate(asked.ROBOTS):
        times = {name: 1e-3 * (k + 1 + n) for k, name in enumerate(asked.METHODS)}
        times |= {"lipschitz": 1e-6, "certified": 2e-3, "simulated": 4e-3, "cut": 0.07}
        others = dict.fromkeys(("cut_percent", "uncut_percent", "certified_sample_percent"), 50.0)
        keys = {"experiment": asked.COSTS, "robot": one, "scale": asked.THESIS}
        rows.append(Run(f"{one}, costs", None, keys, {"seconds": times, **others}, {}))
    return Runs(rows)


def verdict(check, runs):
    return str(check.judge(runs).verdict)


@pytest.fixture(scope="module")
def faultless():
    return made_up()


@pytest.mark.parametrize("check", said.CHECKS, ids=lambda check: check.name)
def test_all_hold_of_rows_without_a_fault(check, faultless):
    assert verdict(check, faultless) == CONFIRMED


PROOFS = {"certified", "lipschitz", "interval"}
LEAST = asked.QUICK_SCALES[0]


@pytest.mark.parametrize(
    ("check", "where", "changed", "expected"),
    [
        *((said._no_false_claims, ("caroca", LEAST), {"unstable": True, proof: True}, NOT_CONFIRMED)
          for proof in sorted(PROOFS)),
        *((said._no_false_claims, ("caroca", LEAST),
           {"unstable": True} | dict.fromkeys(PROOFS - {proof}, False), IN_PART)
          for proof in sorted(PROOFS)),
        (said._certificate_proves_most, ("planar", LEAST), {"certified": False}, IN_PART),
        (said._falls_where_certified, (), {"falls": -0.1}, IN_PART),
        (said._falls_where_certified, (), {"contradicts": True}, IN_PART),
        (said._falls_where_certified, (), {"falls": -0.1, "certified": False}, CONFIRMED),
    ],
)  # fmt: skip
def test_one_fault_is_enough(check, where, changed, expected):
    assert verdict(check, made_up(*where, **changed)) == expected


def test_one_loop_that_ends_elsewhere_is_told():
    runs = made_up(arrived=[True, False, True])
    found = said._arrives_from_certified.judge(runs)
    assert (found.verdict, found.held, found.of) == (IN_PART, 3, 4)
    poses = case_of("caroca", asked.THESIS).items
    assert f"caroca: {K * poses - 1} of {K * poses}" in found.found


def test_a_dear_certificate_is_told(faultless):
    dear = [
        Run(run.case, None, run.keys, {"seconds": {**run["seconds"], "certified": 5e-3}}, {})
        if run["experiment"] == asked.COSTS
        else run
        for run in faultless
    ]
    assert verdict(said._proofs_are_cheap, Runs(dear)) == IN_PART


def test_the_way_ends_in_the_middle_of_the_box():
    """There is no error there, and the printed lever and the exact one are the same."""
    for robot in asked.ROBOTS:
        case, grid = asked.servo_case(robot), asked.bounds_task(robot, asked.THESIS, True).grid
        middle = (grid.lower + grid.upper) / 2.0
        for place in (middle, grid.lower):
            p_WC = place + case.X_PC.translation()
            rows = case.target.rows(case.X_PC.rotation().matrix()[None], p_WC[None])
            assert rows.theta_u == pytest.approx(np.zeros((1, 3)), abs=EXACT)
            assert rows.p_CO == pytest.approx(rows.error, abs=EXACT)
            way = case.X_PC.rotation().matrix().T @ (middle - place)
            assert rows.error[0] == pytest.approx(way, abs=EXACT)


def test_the_task_says_what_the_methods_say_whatever_the_chunk():
    task = asked.bounds_task("planar", 1 / 4, True)
    whole, tail = task(38, 44), task(41, 44)
    assert whole["falls"].shape == (6, task.loops + 1)
    for name, values in tail.items():
        np.testing.assert_array_equal(whole[name][3:], values)
    poses = task.grid.pose_rows(38, 44)
    certified = judge_stability(task.case, task.bounds, poses, "certified", task.options)
    np.testing.assert_array_equal(whole["certified"], certified.stable)
    assert np.all(whole["certified"])  # near the goal, under a quarter of the bounds
    assert np.all(whole["arrived"])
    assert not np.any(whole["contradicts"])


def test_bounds_are_those_of_the_thesis_times_a_scale():
    for robot in asked.ROBOTS:
        bounds: PerturbationBounds = case_of(robot, 1 / 4).task.bounds
        assert bounds.r_bp == pytest.approx(0.03 / 4)
        assert bounds.exits == bounds.anchors == "common"
    assert len(list(asked.cases(Form()))) == 8 * len(asked.ROBOTS)


def test_rows_have_shares_of_cells():
    case = case_of("planar", asked.THESIS)
    row = asked.reduce(case, arrays("planar", asked.THESIS, sampled=False))
    cells = (len(row["x_m"]) - 1) * (len(row["y_m"]) - 1)
    assert row["sampled_percent"] == pytest.approx(100.0 * (1.0 - 1.0 / cells))
    assert row["full_m2"] == pytest.approx(0.96**2)
    assert row["searched_percent"] == 100.0


def test_maps_have_a_panel_for_every_robot_and_method(faultless):
    figure = figures.maps_figure(faultless)
    assert figure_faults(figure) == []
    titles = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert len(titles) == len(asked.ROBOTS) * len(asked.METHODS)
    assert titles[0] == "sampled\n100.0 %, 1 ms"
    assert "Lipschitz\n0.0 %" in titles[4]
    bar = figure.axes[-1]
    assert [text.get_text() for text in bar.get_xticklabels()] == ["none", "1/4", "1"]


def test_tightness_is_a_quotient_of_bounds(faultless):
    assert figures.tightness(faultless, "caroca", "certified") == 1.0
    assert figures.tightness(faultless, "caroca", "lipschitz") == 0.25
    figure = figures.tightness_figure(faultless)
    assert figure_faults(figure) == []
    (panel,) = figure.axes
    drawn = sorted({float(line.get_ydata()[0]) for line in panel.lines})
    assert drawn == [0.25, 1.0]


def test_no_quotient_of_two_scales_is_drawn_as_none():
    assert min(asked.SCALES) / max(asked.SCALES) > figures.NOTHING


def test_shares_are_drawn_against_bounds(faultless):
    figure = figures.shares_figure(faultless)
    assert figure_faults(figure) == []
    panels = figure.axes
    assert len(panels) == len(asked.ROBOTS)
    lines = {line.get_label(): line for line in panels[0].lines}
    assert list(lines["Lipschitz"].get_ydata()) == [100.0, 0.0]


def test_tables_have_a_row_for_every_robot_and_bounds(faultless):
    assert shares_table(faultless).row_count == len(asked.ROBOTS) * len(asked.QUICK_SCALES)
    assert costs_table(faultless).row_count == 2 * len(asked.ROBOTS)
    assert STUDY.names_of_checks()[0] == "no_false_claims"
    shares = [case for case in asked.cases(Form()) if case.keys["experiment"] == asked.SHARES]
    assert [case.alone for case in shares] == [False] * 7 * len(asked.ROBOTS)
