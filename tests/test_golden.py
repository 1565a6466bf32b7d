"""The script of golden files: it sees one changed digit, and what is missing."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cdpr_drake.analyses.studies.study import STUDIES
from tests.golden import __main__ as golden
from tests.golden import making
from tests.golden.command_lines import COMMAND_LINES, INPUT_FILES, commands_of
from tests.golden.comparison import MADE_BY
from tests.golden.making import Item
from tests.golden.problems import BATCH, COUNT, problem
from tests.golden.questions import QUESTIONS, words_of, write_inputs
from tests.golden.stripped import digest, read_results, strip, text_lines, without_words

RESULT = {
    "verdict": "feasible",
    "tensions_n": [7.086537082646042, 0.0],
    "wall_time_s": 3.0,
    "nested": {"versions": {"numpy": "2"}, "limit": None},
}
ROBOTS = [
    {"name": name, "frame_m": [[-1, -1, 0], [1, 1, 2]], "platform_mass_kg": 2.0, "cables": 8,
     "motion": "3R3T", "cameras": {"onboard": "ids_kowa"}}
    for name in ("one", "two")
]  # fmt: skip


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """A folder of two golden files, and what makes them; `now` is what is made next."""
    now = {"studies/a": json.loads(json.dumps(RESULT)), "studies/b": {"x": 1}}
    items = [Item(f"{n}.json", lambda work, n=n: strip(now[n])) for n in now]
    monkeypatch.setattr(golden, "all_items", lambda inputs: items)
    monkeypatch.setattr(golden, "code_state", lambda: "first")

    def run(*words):
        monkeypatch.setattr(sys, "argv", ["golden", *words])
        return golden.main()

    assert run("make", str(tmp_path / "gold")) == 0
    return tmp_path / "gold", now, run


def test_the_same_results_are_the_same_though_time_and_versions_differ(kept, capsys):
    folder, now, run = kept
    now["studies/a"]["wall_time_s"] = 4.0
    now["studies/a"]["nested"]["versions"] = {"numpy": "3"}
    assert run("compare", str(folder)) == 0
    assert "2 files compared, 0 differences" in capsys.readouterr().out


def test_one_changed_digit_is_told_with_key_values_and_size(kept, capsys):
    folder, now, run = kept
    now["studies/a"]["tensions_n"][0] = 7.086537082646043
    assert run("compare", str(folder)) == 1
    out = capsys.readouterr().out
    assert "studies/a.json: tensions_n/0: 7.086537082646042 -> 7.086537082646043" in out
    assert "largest relative difference 1.253e-16" in out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda a: a.pop("verdict"), "verdict: 'feasible' -> (not there)"),
        (lambda a: a.update(more=None), "more: (not there) -> None"),
        (lambda a: a["tensions_n"].pop(), "tensions_n/length: 2 -> 1"),
        (lambda a: a["nested"].update(limit=0.0), "nested/limit: None -> 0.0"),
        (lambda a: a.update(verdict=True), "verdict: 'feasible' -> True"),
    ],
)
def test_what_is_missing_new_or_of_another_kind_is_told(kept, capsys, change, words):
    folder, now, run = kept
    change(now["studies/a"])
    assert run("compare", str(folder)) == 1
    assert f"studies/a.json: {words}" in capsys.readouterr().out


def test_a_study_that_is_not_there_any_more_is_told(kept, capsys):
    folder, _, run = kept
    (folder / "studies" / "gone.json").write_text('{"x": 1}\n')
    assert run("compare", str(folder)) == 1
    assert "studies/gone.json: : {'x': 1} -> (not there)" in capsys.readouterr().out


def test_what_is_finished_is_not_made_again_unless_asked(kept, capsys):
    folder, now, run = kept
    now["studies/b"]["x"] = 2
    (folder / "studies" / "a.json").write_text("{ cut off")
    assert run("make", str(folder)) == 0
    out = capsys.readouterr().out
    assert "studies/b.json: kept" in out
    assert json.loads((folder / "studies" / "a.json").read_text())["verdict"] == "feasible"
    assert json.loads((folder / "studies" / "b.json").read_text())["x"] == 1
    assert run("make", str(folder), "--again", "--only", "studies/b") == 0
    assert json.loads((folder / "studies" / "b.json").read_text()) == {MADE_BY: "first", "x": 2}


def test_comparing_makes_again_what_other_code_made(kept, monkeypatch, capsys):
    folder, now, run = kept
    assert run("compare", str(folder)) == 0
    now["studies/b"]["x"] = 3
    assert run("compare", str(folder)) == 0  # the same code is not asked twice
    monkeypatch.setattr(golden, "code_state", lambda: "second")
    assert run("compare", str(folder)) == 1
    assert "studies/b.json: x: 1 -> 3" in capsys.readouterr().out


def test_what_fails_is_told_and_leaves_nothing(kept, monkeypatch, capsys):
    folder, _, run = kept

    def fail(work):
        raise RuntimeError("exit code 3: no space left")

    monkeypatch.setattr(golden, "all_items", lambda inputs: [Item("studies/c.json", fail)])
    assert run("make", str(folder)) == 1
    assert "studies/c.json: FAILED: exit code 3: no space left" in capsys.readouterr().out
    assert not list(folder.rglob("c.json"))
    assert not list(folder.glob(".making-*"))


def test_only_refuses_what_is_not_there(kept):
    folder, _, run = kept
    with pytest.raises(SystemExit, match="found 'studies/d'; accepted: studies/a, studies/b"):
        run("make", str(folder), "--only", "studies/d")


def test_arrays_are_told_apart_by_one_bit_and_measured(tmp_path):
    values = np.linspace(0.0, 1.0, 11)
    changed = values.copy()
    changed[3] = np.nextafter(changed[3], 1.0)
    assert digest(values)["sha256"] != digest(changed)["sha256"]
    assert digest(values) == digest(values.copy())
    assert digest(values)["mean"] == pytest.approx(0.5)
    np.savez(tmp_path / "log.npz", tensions=values, wall_time=values)
    (tmp_path / "summary.json").write_text(json.dumps(RESULT | {"message": "in /tmp/some/run, or"}))
    found = read_results(tmp_path)
    assert found["log.npz"] == {"tensions": digest(values)}
    assert found["summary.json"]["message"] == "in <path>, or"
    assert "wall_time_s" not in found["summary.json"]
    assert found["files"] == ["log.npz", "summary.json"]


def test_a_text_among_arrays_is_read_without_versions(tmp_path):
    """Else every new state of the sources would be another result."""
    kept = []
    for version, mass in (("0.1.0 aa", 1.0), ("0.2.0 bb", 1.0), ("0.2.0 bb", 1.5)):
        np.savez(tmp_path / "a.npz", about=json.dumps({"cdpr_drake": version, "mass": mass}))
        kept.append(read_results(tmp_path)["a.npz"])
    assert kept[0] == kept[1] == {"about": {"mass": 1.0}}
    assert kept[2] != kept[0]


def test_every_study_has_a_golden_file():
    """Also those with a point in their name."""
    assert making.study_names() == list(STUDIES)


def test_questions_on_files_have_their_inputs(tmp_path):
    write_inputs(tmp_path)
    files = {path.name for path in tmp_path.iterdir()}
    named = {
        word for text in QUESTIONS.values() for word in text.split()
        if Path(word).suffix in (".csv", ".yaml", ".txt", ".log", ".py", ".png", ".gcode")
    }  # fmt: skip
    assert named == files
    assert words_of("replay/lengths", tmp_path)[1] == str(tmp_path / "replay.csv")


def test_command_lines_have_their_inputs_and_ask_for_json():
    named = {
        word for text in COMMAND_LINES.values() for word in text.split() if word in INPUT_FILES
    }
    for name, text in INPUT_FILES.items():
        assert name in named or any(name in other for other in INPUT_FILES.values()), text
    assert commands_of("commands/robots") == [["robots", "--json"]]
    assert commands_of("commands/schema-robot") == [["schema", "robot"]]
    assert [words[0] for words in commands_of("commands/stability-along")] == [
        "simulate", "stability",
    ]  # fmt: skip


def test_a_command_line_keeps_what_is_printed_and_written_but_no_words_of_a_refusal(
    tmp_path, monkeypatch
):
    """A command that prints, one that refuses in words, one that refuses and prints, a failure."""
    found = {}

    def run(work, words):
        (work / "out").mkdir(exist_ok=True)
        (work / "out" / "a.yaml").write_text("name: mine\n# Check it with `cdpr check a.yaml`.\n")
        return subprocess.CompletedProcess(words, *found["ends"])

    monkeypatch.setattr(making, "_run", run)
    found["ends"] = 0, '{"mass_kg": 2.0, "wall_time_s": 3.0}', ""
    kept = making._command_line(tmp_path, "commands/robots")
    assert kept["printed"] == {"mass_kg": 2.0}
    assert kept["texts"] == text_lines(tmp_path / "out") == {"a.yaml": ["name: mine"]}
    found["ends"] = 2, "", "cdpr: refused"
    assert making._command_line(tmp_path, "commands/robots") == {"exit code": 2}
    found["ends"] = 2, '[{"problems": ["this", "that"]}]', ""
    kept = making._command_line(tmp_path, "commands/check-bad")
    assert kept == {"exit code": 2, "printed": [{"problems": ["", ""]}]}
    found["ends"] = 1, "", "Traceback"
    with pytest.raises(RuntimeError, match="exit code 1: Traceback"):
        making._command_line(tmp_path, "commands/robots")
    with pytest.raises(RuntimeError, match="export: exit code 1"):
        making._command_line(tmp_path, "commands/import-sdf")
    assert without_words({"a": ["x", None, 1.0]}) == {"a": ["", None, 1.0]}


def test_a_refused_scenario_is_a_failure(tmp_path):
    with pytest.raises(RuntimeError, match=r"exit code 2: cdpr: .*no_such"):
        making._written(tmp_path, "simulate", "no_such")


def test_problems_are_the_same_by_number_and_of_every_kind():
    """Some exports are asked for twice: two robots here, and few formats."""
    asked = [problem(number, ROBOTS) for number in range(COUNT)]
    assert asked == [problem(number, ROBOTS) for number in range(COUNT)]
    assert {each.arguments[0] for each in asked} == {
        "tension", "static", "workspace", "equilibria", "stability", "export",
    }  # fmt: skip
    assert sum(each.arguments[0] == "tension" for each in asked) == 360
    assert sum("--certify" in each.arguments for each in asked) == 80
    assert len({each.arguments for each in asked}) > 0.97 * COUNT
    assert COUNT % BATCH == 0


def test_a_batch_is_answered_by_the_command(tmp_path, monkeypatch):
    """Answers of the printed kind and of the written kind, a refusal and a failure."""
    (tmp_path / "robots.json").write_text(json.dumps(ROBOTS))

    def answer():
        out = sys.argv[sys.argv.index("--out") + 1] if "--out" in sys.argv else None
        if out is not None:
            print("cdpr: out: refused", file=sys.stderr)
            sys.exit(2)
        print(json.dumps({"asked": sys.argv[1], "versions": {}}))

    class Entry:
        @staticmethod
        def load():
            return answer

    monkeypatch.setattr(making, "entry_points", lambda **named: (Entry,))
    monkeypatch.setattr(sys, "argv", ["before"])
    monkeypatch.chdir(tmp_path)
    making.answer_batch(tmp_path, 0)
    found = json.loads((tmp_path / "answers.json").read_text())
    assert len(found) == BATCH
    for command, each in found.items():
        if "--out" in command:
            assert each == {"exit code": 2, "refused": ["cdpr: out: refused"]}
        else:
            assert each["printed"] == {"asked": command.split()[2]}
    with pytest.raises(RuntimeError, match="exit code 5: broken"):
        making._answer(5, "broken", None)
