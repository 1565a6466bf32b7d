"""The frame of studies: what it runs, keeps, continues, judges, tells and writes."""

import json
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import pytest
from matplotlib.figure import Figure

from cdpr_drake.analyses.reporting.progress import StudySession
from cdpr_drake.analyses.reporting.statements import new_table
from cdpr_drake.analyses.studies.framework.runs import (
    MissingRuns,
    Run,
    Runs,
    UnknownName,
    pack_row,
    unit_of,
    unpack_row,
)
from cdpr_drake.analyses.studies.framework.statement import (
    CONSTRUCTION,
    FITTED,
    OURS,
    Finding,
    judged,
    judged_table,
    scorecard,
    statement,
)
from cdpr_drake.analyses.studies.framework.study import Case, Form, Study
from cdpr_drake.analyses.studies.framework.summary import Cell, Summary, note_coarse
from cdpr_drake.errors import OutputFolderError

FACTORS = {"small": 1.0, "large": 10.0, "few": 3.0}


@dataclass(frozen=True)
class Squares:
    """A task of a sweep: squares of its items."""

    def __call__(self, start, stop):
        """Squares."""
        return {"squares": np.arange(start, stop, dtype=float) ** 2}


def cases(form):
    """Three cases over seeds, one without `few` in the quick form, and two over items."""
    for name, factor in FACTORS.items():
        if not (form.quick and name == "few"):
            yield Case(
                name=name,
                keys={"size": name, "kind": "seeded"},
                data=factor,
                printed={"peak_m": "0.3"} if name == "few" else {},
                most=1 if name == "few" else None,
            )
    yield Case(name="sum", keys={"size": "sum", "kind": "task"}, task=Squares(), items=10)
    yield Case(name="end", keys={"size": "end", "kind": "task"}, same_task="sum")


def measure(case, seed):
    """A row with numbers, words, a curve whose length depends on the seed."""
    return {
        "peak_m": 0.1 * case.data + seed / 3.0,
        "lost": seed == 1,
        "outcome": "arrived" if seed != 1 else "lost",
        "nothing": None if seed == 0 else 1.0,
        "parts": {"a": [1, 2.5, np.nan]},
        "curve_m": np.linspace(0.0, case.data, 3 + seed),
    }


def reduce(case, arrays):
    """The sum of squares, or the last."""
    squares = arrays["squares"]
    return {"value": float(np.sum(squares) if case.name == "sum" else squares[-1])}


@statement("Large is larger.", "ten times", rule="at least 2.5 times", source="1.2")
def larger(runs):
    """Large beside small, mean by mean and peak by peak."""
    ratios = [
        getattr(runs, name)("peak_m", size="large") / getattr(runs, name)("peak_m", size="small")
        for name in ("mean", "largest")
    ]
    return Finding(found=f"{ratios[0]:.2f}", held=[ratio >= 2.5 for ratio in ratios])


@statement("Few are few.", basis=OURS)
def few(runs):
    """Needs what the quick form does not have."""
    return Finding(found="", held=[len(runs(size="few")) == 1])


def draw(runs):
    """A figure of what the quick form does not have."""
    runs(size="few")
    return Figure()


STUDY = Study(
    name="example",
    title="An example",
    cases=cases,
    measure=measure,
    reduce=reduce,
    seeds=(3, 1),
    checks=(larger, few),
    tables=[
        Summary(
            "Peaks",
            ("size",),
            {
                "n": Cell("runs"),
                "kept": Cell("runs", where={"lost": False}),
                "peak [mm]": Cell("largest", "peak_m", ".1f"),
            },
            where={"kind": "seeded"},
        )
    ],
    figures={"few": draw, "all": lambda runs: Figure()},
    parameters=lambda form: {"factors": FACTORS},
    chunk=4,
)

LOCAL = StudySession(workers=1)


def run(quick=False, session=LOCAL, **changes):
    return replace(STUDY, **changes)(quick, session)


def stopped(after, folder=None, **changes):
    """The full form, told to stop when it has asked so often whether it shall."""
    asked = iter([False] * after + [True] * 100)
    return run(session=replace(LOCAL, folder=folder, should_stop=lambda: next(asked)), **changes)


@pytest.fixture(scope="module")
def full():
    return run()


@pytest.fixture(scope="module")
def quick():
    return run(quick=True)


def test_rows_keep_their_bits():
    row = measure(Case(name="x", data=1.0 / 3.0), 2)
    back = unpack_row(pack_row(row))
    np.testing.assert_array_equal(back.pop("curve_m"), row.pop("curve_m"))
    assert repr(back) == repr(row)  # NaN too


@pytest.mark.parametrize("value", [Form(), {1, 2}, np.array([None])])
def test_a_row_holds_only_what_can_be_kept(value):
    with pytest.raises(TypeError, match="column 'x'"):
        pack_row({"x": value})


@pytest.mark.parametrize(
    ("column", "unit"),
    [("peak_m", "m"), ("v_m_s", "m/s"), ("a_n_m", "N m"), ("m", ""), ("loss", ""), ("x_us", "us")],
)
def test_units_are_in_names(column, unit):
    assert unit_of(column) == unit


def test_cases_are_measured_as_often_as_the_form_says(full, quick):
    assert len(full.runs) == 3 + 3 + 1 + 2
    assert len(quick.runs) == 1 + 1 + 2
    seeds = run(session=replace(LOCAL, seeds=2)).runs
    assert [seeds.counts("size")[name] for name in FACTORS] == [2, 2, 1]


def test_a_case_over_items_is_reduced_to_a_row_and_its_task_done_once(full):
    assert set(full.finished) & {"sum", "end"} == {"sum"}
    assert full.runs.one(size="sum")["value"] == sum(k**2 for k in range(10))
    assert full.runs.one(size="end")["value"] == 81.0


def test_a_task_may_tell_what_its_numbers_depend_on():
    @dataclass(frozen=True)
    class Told(Squares):
        secret: object = None

        def arguments(self):
            return {"squares": "of items"}

    case = Case(name="a", task=Told(object()), items=2)
    assert case.arguments() == {"task": {"squares": "of items"}, "items": 2}


def test_runs_are_picked_and_reduced(full):
    runs = full.runs(kind="seeded")
    assert runs.largest("peak_m", size=("small", "large")) == 1.0 + 2.0 / 3.0
    assert runs(size="small", lost=True).list("seed") == [1]
    assert runs.counted("outcome", size="small") == "2 arrived, 1 lost"
    assert np.isnan(runs(size="small")["nothing"][0])
    assert [len(curve) for curve in runs(size="small").list("curve_m")] == [3, 4, 5]
    assert np.isnan(runs.mean("peak_m", size="few", lost=True))
    assert runs.one(size="few").printed == {"peak_m": "0.3"}
    assert {size: len(some) for size, some in runs.by("size")} == {"small": 3, "large": 3, "few": 1}


def test_means_by_the_values_of_a_key(full, quick):
    means = full.runs.means("peak_m", size=("large", "small"))
    assert means.tolist() == [full.runs.mean("peak_m", size=size) for size in ("large", "small")]
    with pytest.raises(UnknownName, match="did you mean"):
        full.runs.means("peak_m", size=("large", "smal"))
    with pytest.raises(MissingRuns):
        quick.runs.means("peak_m", size=("small", "few"))


@pytest.mark.parametrize(
    "where", [{"size": "smal"}, {"siz": "small"}, {"size": "small", "los": True}]
)
@pytest.mark.parametrize("form", ["full", "quick"])
def test_a_misspelling_is_never_missing(where, form, request):
    runs = request.getfixturevalue(form).runs
    with pytest.raises(UnknownName, match="did you mean"):
        runs(**where)
    with pytest.raises(UnknownName):
        runs.has(**where)
    with pytest.raises(UnknownName):
        runs(size="small")["peak"]


def test_runs_that_lack_are_told_from_misspellings(quick):
    assert not quick.runs.has(size="few")
    with pytest.raises(MissingRuns, match="size few"):
        quick.runs(size="few")
    with pytest.raises(MissingRuns):
        Runs([], quick.runs.planned)(size="small")


def test_statements_are_judged_part_by_part_and_what_the_quick_form_lacks_is_named(full, quick):
    said = {one.name: one for one in full.statements}
    assert (said["larger"].held, said["larger"].of) == (1, 2)
    assert said["larger"].verdict_words == "in part (1 of 2)"
    assert said["few"].verdict == "confirmed"
    said = {one.name: one for one in quick.statements}
    assert said["few"].verdict == "not judged in the quick form"
    assert said["few"].words == "Few are few."


@pytest.mark.parametrize("mistake", [lambda runs: runs(sise="small"), lambda runs: 1 / 0])
@pytest.mark.parametrize("quick", [False, True])
def test_a_mistake_in_a_check_is_told_and_drops_nothing(mistake, quick):
    broken = statement("It is so.", name="broken")(mistake)
    said = run(quick, checks=(broken, larger)).statements
    assert [one.name for one in said] == ["broken", "larger"]
    assert said[0].verdict == "not judged"
    assert "judging failed" in said[0].found


def test_runs_that_lack_in_a_whole_full_form_are_a_mistake():
    both = statement("It is so.", name="both")(lambda runs: runs(size="few", kind="task"))
    (said,) = run(checks=(both,)).statements
    assert (said.verdict, said.found) == ("not judged", "runs are missing: kind task")


def found_with(held, basis="test", **more):
    check = statement("It is so.", basis=basis, **more)(lambda runs: Finding(found="", held=held))
    return judged([replace(check, name=f"{basis}{held}")], Runs([]))[0]


@pytest.mark.parametrize(
    ("held", "basis", "verdict"),
    [
        ([True, True], "test", "confirmed"),
        ([True], OURS, "confirmed"),
        ([True], FITTED, "met (fitted)"),
        ([True], CONSTRUCTION, "met (by construction)"),
        ([True, False], FITTED, "in part"),
        ([False], CONSTRUCTION, "not confirmed"),
        ([], "test", "not testable"),
    ],
)
def test_a_verdict_says_what_it_rests_on(held, basis, verdict):
    assert found_with(held, basis).verdict == verdict


def test_an_unknown_basis_is_refused():
    with pytest.raises(ValueError, match="basis"):
        found_with([True], "guess")


def test_the_scorecard_counts_each_fact_once():
    said = [
        found_with([True]),
        found_with([True], same_as="other/check"),
        found_with([True], FITTED),
        found_with([False], OURS),
    ]
    assert scorecard(said) == {
        "verdicts": {"confirmed": 1, "met (fitted)": 1},
        "ours": {"not confirmed": 1},
        "independent": 1,
        "repeated": 1,
    }


def test_it_is_written_for_people_and_programs_and_a_whole_study_leaves_nothing_out(full, tmp_path):
    assert full.write(tmp_path) == {}
    told = json.loads((tmp_path / "results.json").read_text())
    assert told["left_out"] == {"figures": {}, "tables": {}, "numbers": {}}
    assert told["items"] == {"done": 17, "of": 17, "by_earlier_sessions": 0}
    assert told["units"] == {"peak_m": "m", "curve_m": "m"}
    assert told["arrays"] == ["curve_m"]
    assert told["runs"][1]["case"] == "small"
    assert told["runs"][1]["lost"] is True
    rows = (tmp_path / "runs.csv").read_text().splitlines()
    assert rows[0] == "case,size,kind,seed,peak_m,lost,outcome,nothing,parts,value"
    assert rows[2].startswith("small,small,seeded,1,0.43333333333333335,true,lost,1.0,")
    assert rows[-1] == "end,end,task,,,,,,,81.0"
    assert len(rows) == 10
    assert {path.name for path in tmp_path.glob("*.png")} == {"few.png", "all.png"}
    assert len(full.tables()) == 2


def test_the_table_of_statements_parts_rule_and_why():
    @statement("Large is larger.", rule="each run")
    def check(runs):
        return Finding(found="", held=[True], why="it is heavier")

    table = judged_table("", judged([check], Runs([])))
    assert list(table.columns[-1].cells) == ["each run; it is heavier"]


def lacking(runs):
    """Asks for what no form has."""
    raise MissingRuns("size huge")


def left_out(folder):
    return json.loads((folder / "results.json").read_text())["left_out"]


def test_figures_and_tables_of_runs_that_lack_are_left_out_of_the_quick_form_and_named(tmp_path):
    quick = run(quick=True, tables=[*STUDY.tables, lacking], numbers=lacking)
    assert quick.write(tmp_path) == {}
    assert {path.name for path in tmp_path.glob("*.png")} == {"all.png"}
    assert left_out(tmp_path) == {
        "figures": {"few": "runs are missing: size few"},
        "tables": {"lacking": "runs are missing: size huge"},
        "numbers": {"numbers": "runs are missing: size huge"},
    }
    assert [table.title for table in quick.tables()] == ["Peaks", STUDY.stated]


def test_figures_and_tables_of_runs_that_lack_in_a_whole_full_form_are_failures(tmp_path):
    whole = run(figures={"odd": lacking}, tables=[lacking, partial(lacking), *STUDY.tables])
    assert whole.write(tmp_path, ("png", "svg")) == dict.fromkeys(
        ("odd.png", "odd.svg"), "runs are missing: size huge"
    )
    assert not list(tmp_path.glob("odd*"))
    assert left_out(tmp_path)["figures"] == {"odd": "runs are missing: size huge"}
    first, second, *others = whole.tables()
    for table in (first, second):
        assert table.title == "lacking"
        assert [list(column.cells) for column in table.columns] == [["runs are missing: size huge"]]
    assert [table.title for table in others] == ["Peaks", STUDY.stated]


def test_statements_see_whole_cases_only_and_a_stopped_full_form_has_no_failures(tmp_path):
    found = stopped(2, figures={"odd": lacking}, tables=[lacking])
    assert 0 < len(found.runs) < 3
    assert len(found.whole) == 0
    assert found.write(tmp_path) == {}
    assert set(left_out(tmp_path)["figures"]) == {"odd"}
    assert len(found.tables()) == len(found.statements[:1])


def test_a_stopped_study_continues_to_the_same_bytes(tmp_path):
    whole, parted = tmp_path / "whole", tmp_path / "parted"
    run(session=replace(LOCAL, folder=whole)).write(whole)
    first = stopped(4, parted)
    assert first.interrupted
    assert 0 < len(first.runs) < 9
    assert "few" not in {one.name for one in first.statements}
    continued = run(session=replace(LOCAL, folder=parted))
    assert continued.progress.found > 0
    continued.write(parted)
    for name in ("parts.npz", "runs.csv"):
        assert (whole / name).read_bytes() == (parted / name).read_bytes()
    one, other = (json.loads((each / "results.json").read_text()) for each in (whole, parted))
    assert one.pop("items") != other.pop("items")
    assert one == other
    with pytest.raises(OutputFolderError, match="runs is 3 there, 2 here"):
        run(session=replace(LOCAL, folder=parted, seeds=2))


def test_names_of_cases_are_unique_and_files():
    twice = replace(STUDY, cases=lambda form: [Case(name="a"), Case(name="a")])
    for cases_of in (twice, replace(STUDY, cases=lambda form: [Case(name="a/b")])):
        with pytest.raises(ValueError, match="accepted: each once"):
            cases_of.plan(Form())


def test_without_pandas_a_frame_is_refused_with_the_file_that_has_the_same(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(ImportError, match=r"runs\.csv"):
        Runs([Run("a", None, {}, {"x": 1.0})]).frame()


def test_a_frame_for_those_who_have_pandas(full, tmp_path):
    """It has the rows of the file: numbers, words, truth values, nothing for None, no arrays."""
    pd = pytest.importorskip("pandas")
    runs, frame = full.runs, full.runs.frame()
    assert len(frame) == len(runs)
    assert list(frame.columns) == [
        "case", "size", "kind", "seed", "peak_m", "lost", "outcome", "nothing", "parts", "value",
    ]  # fmt: skip
    small = frame[frame["size"] == "small"]
    np.testing.assert_array_equal(small["peak_m"].to_numpy(), runs(size="small")["peak_m"])
    assert small["lost"].tolist() == [False, True, False]
    assert small["nothing"].isna().tolist() == [True, False, False]
    assert frame.groupby("size")["peak_m"].mean()["large"] == runs.mean("peak_m", size="large")
    assert frame["value"].dropna().tolist() == [285.0, 81.0]
    runs.write_csv(tmp_path / "runs.csv")
    read = pd.read_csv(tmp_path / "runs.csv")
    assert list(read.columns) == list(frame.columns)
    for column in ("case", "peak_m", "value"):
        pd.testing.assert_series_equal(read[column], frame[column], check_dtype=False)


def caption(before, *quick):
    table = new_table("Shares", ("robot",), ())
    table.caption = before
    runs = [Run(str(n), None, {"grid": Form(one).grid}, {}) for n, one in enumerate(quick)]
    return note_coarse(table, Runs(runs), "it means little.").caption


def test_tables_of_coarse_grids_say_so_and_those_of_full_grids_and_of_none_nothing():
    assert caption(None, True, True) == "Coarse grid: it means little."
    assert caption("In per cent.", False, True) == "In per cent.\nCoarse grid: it means little."
    assert caption("In per cent.", False) == "In per cent."
    assert caption(None) is None
    table = new_table("Distances", ("robot",), ())
    assert note_coarse(table, Runs([Run("a", None, {"robot": "a"}, {})])).caption is None
