"""Runs studies, scenarios and problems by the command `cdpr`, and keeps their results."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

from tests.golden.command_lines import COMMAND_LINES, commands_of, write_input_files
from tests.golden.comparison import MADE_BY
from tests.golden.problems import BATCH, COUNT, problem, read_robots, write_files
from tests.golden.questions import QUESTIONS, words_of
from tests.golden.stripped import read_results, strip, text_lines, without_words

ROOT = Path(__file__).parents[2]
LONGEST_RUN = 10.0
"""Simulated time of a scenario at most [s]."""

RENDERED_RUN = 1.0
"""Simulated time of a scenario with rendered images [s]."""

REFUSED = 2
"""Exit code of a refusal."""

ACCEPTED_CODES = (0, REFUSED, 6)
"""Exit codes of an answer: 2 refuses, 6 tells that measurements contradict the model."""


_WRITE_INPUTS = """
import sys
from pathlib import Path
from tests.golden.questions import write_inputs
part = Path(sys.argv[1] + ".part")
part.mkdir(exist_ok=True)
write_inputs(part)
part.rename(sys.argv[1])
"""


@dataclass(frozen=True)
class Item:
    """One golden file: its name from the folder, and what makes it in an empty folder."""

    file: str
    make: Callable[[Path], dict[str, Any]]


def command(*words: str) -> str:
    """What `cdpr` prints for a question that has an answer."""
    done = subprocess.run(
        [_program(), *words], capture_output=True, text=True, check=False, env=_wide()
    )
    if done.returncode:
        raise SystemExit(f"cdpr {' '.join(words)}: exit code {done.returncode}: {done.stderr}")
    return done.stdout


def _program() -> str:
    """`cdpr` beside this Python."""
    found = shutil.which("cdpr", path=str(Path(sys.executable).parent)) or shutil.which("cdpr")
    if found is None:
        raise SystemExit("cdpr is not installed for this Python")
    return found


def _wide() -> dict[str, str]:
    return {**os.environ, "COLUMNS": "100000", "MPLBACKEND": "agg"}


def study_names() -> list[str]:
    """Names of all studies, from the help of `cdpr study`."""
    found = re.search(r"Which study[:.] (?:\[choices: )?(.*?)[].]", command("study", "--help"))
    if found is None:
        raise SystemExit("cdpr study --help does not list the studies any more")
    return [word.strip() for word in found[1].split(",")]


def scenario_facts() -> list[dict[str, Any]]:
    """What `cdpr scenarios --json` says of each."""
    facts: list[dict[str, Any]] = json.loads(command("scenarios", "--json"))
    return facts


def all_items(inputs: Path) -> list[Item]:
    """Every golden file.

    Args:
        inputs: Folder with the input files of `QUESTIONS`, made when the first of them is asked.
    """
    robots = read_robots(command("robots", "--json"))
    batches = [
        Item(f"problems/{first:04d}.json", lambda work, n=first: _batch(work, n, robots))
        for first in range(0, COUNT, BATCH)
    ]
    scenarios = [item for facts in scenario_facts() for item in _scenario_items(facts)]
    studies = [
        Item(f"studies/{name}.json", lambda work, n=name: _written(work, "study", n, "--quick"))
        for name in study_names()
    ]
    questions = [
        Item(f"{name}.json", lambda work, n=name: _question(work, n, inputs)) for name in QUESTIONS
    ]
    lines = [Item(f"{name}.json", partial(_command_line, name=name)) for name in COMMAND_LINES]
    return [*batches, *scenarios, *studies, *questions, *lines]


def _command_line(work: Path, name: str) -> dict[str, Any]:
    """What a command line prints and writes; of a refusal, neither words nor files.

    Raises:
        RuntimeError: It fails, or a command before it does not make its files.
    """
    write_input_files(work)
    *before, last = commands_of(name)
    for words in before:
        done = _run(work, words)
        if done.returncode:
            raise RuntimeError(f"{words[0]}: exit code {done.returncode}: {done.stderr[-500:]}")
    done = _run(work, last)
    printed = done.stdout if done.stdout.startswith(("{", "[")) else None
    if done.returncode == REFUSED:
        answer: dict[str, Any] = {"exit code": REFUSED}
        if printed is not None:  # the count of problems of each file
            answer["printed"] = without_words(json.loads(printed))
        return answer
    answer = _answer(done.returncode, done.stderr, work / "out")
    if (work / "out").is_dir():
        answer["texts"] = text_lines(work / "out")
    if printed is not None:
        answer["printed"] = strip(json.loads(printed))
    return answer


def _run(work: Path, words: list[str]) -> subprocess.CompletedProcess[str]:
    """Ends of `cdpr` in a folder."""
    return subprocess.run(
        [_program(), *words], cwd=work, capture_output=True, text=True, check=False, env=_wide()
    )


def _question(work: Path, name: str, inputs: Path) -> dict[str, Any]:
    """Results of a command on input files, what it writes and what it prints, or its refusal."""
    if not inputs.is_dir():
        subprocess.run(
            [sys.executable, "-c", _WRITE_INPUTS, str(inputs)], cwd=ROOT, check=True,
        )  # fmt: skip
    words = [_program(), *words_of(name, inputs), "--json"]
    words += ["--out", "out.csv" if name.startswith("import-log") else "out"]
    done = subprocess.run(
        words, cwd=work, capture_output=True, text=True, check=False, env=_wide()
    )  # fmt: skip
    answer = _answer(done.returncode, done.stderr, work / "out")
    if (work / "out.csv").is_file():
        answer["rows"] = (work / "out.csv").read_text(encoding="utf-8").splitlines()
    if done.returncode != 2:
        answer["printed"] = strip(json.loads(done.stdout))
    return answer


def _scenario_items(facts: dict[str, Any]) -> list[Item]:
    """A scenario with a projected camera, and briefly as it ships, if that renders."""
    name, rendered = facts["name"], facts["camera"] == "rendered"
    whole = ["simulate", name, "--duration", str(min(facts["duration_s"], LONGEST_RUN))]
    brief = ["simulate", name, "--duration", str(min(facts["duration_s"], RENDERED_RUN))]
    projected = [*whole, "--camera", "projected"] if rendered else whole
    items = [Item(f"scenarios/{name}.json", lambda work: _written(work, *projected))]
    if rendered:
        items.append(Item(f"scenarios/{name}-rendered.json", lambda work: _written(work, *brief)))
    return items


def _written(work: Path, *words: str) -> dict[str, Any]:
    """Results of a command that writes a folder.

    Raises:
        RuntimeError: It failed, or refused.
    """
    done = subprocess.run(
        [_program(), *words, "--out", "out"], cwd=work, capture_output=True, text=True,
        check=False, env=_wide(),
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-500:]}")
    return _answer(done.returncode, done.stderr, work / "out")


def _answer(code: int, said: str, out: Path | None, texts: bool = False) -> dict[str, Any]:
    """An exit code, what was refused in words, and what was written.

    Raises:
        RuntimeError: It is no answer, but a failure.
    """
    if code not in ACCEPTED_CODES:
        raise RuntimeError(f"exit code {code}: {said.strip()[-500:]}")
    refused = [line for line in said.splitlines() if line.startswith("cdpr: ")]
    answer: dict[str, Any] = {"exit code": code, "refused": strip(refused)}
    if out is not None and out.is_dir():
        answer["written"] = read_results(out, texts)
    return answer


def _batch(work: Path, first: int, robots: list[dict]) -> dict[str, Any]:
    """Answers of a batch of problems, by number and command, from a process of its own."""
    (work / "robots.json").write_text(json.dumps(robots), encoding="utf-8")
    answers = work / "answers.json"
    done = subprocess.run(
        [sys.executable, "-m", "tests.golden", "batch", str(work), str(first)], cwd=ROOT,
        capture_output=True, text=True, check=False, env=_wide(),
    )  # fmt: skip
    if done.returncode or not answers.is_file():
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-500:]}")
    found: dict[str, Any] = json.loads(answers.read_text(encoding="utf-8"))
    return found


def answer_batch(work: Path, first: int) -> None:
    """Answers problems one after the other in this process, and writes answers.json."""
    robots = read_robots((work / "robots.json").read_text(encoding="utf-8"))
    (program,) = entry_points(group="console_scripts", name="cdpr")
    main = program.load()
    answers = {}
    for number in range(first, min(first + BATCH, COUNT)):
        asked = problem(number, robots)
        folder = work / f"{number:04d}"
        folder.mkdir()
        os.chdir(folder)
        write_files(asked, folder)
        code, said, printed = _call(main, asked.arguments)
        out = None if asked.out is None else folder / asked.out
        answer = _answer(code, said, out, asked.texts)
        if code == 0 and (out is None or asked.texts):
            answer["printed"] = strip(json.loads(printed))
        answers[f"{number:04d} cdpr {' '.join(asked.arguments)}"] = answer
        os.chdir(work)
        shutil.rmtree(folder)
    (work / "answers.json").write_text(json.dumps(answers), encoding="utf-8")


def _call(main: Callable[[], Any], arguments: tuple[str, ...]) -> tuple[int, str, str]:
    """Calls the command in this process: exit code, stderr, stdout."""
    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["cdpr", *arguments]
    code: Any = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    return int(code), err.getvalue(), out.getvalue()


def code_state() -> str:
    """Twelve digits that change with the sources and data that results depend on."""
    hashed = hashlib.sha256()
    tops = sorted(
        path for path in ROOT.iterdir()
        if path.is_dir() and not path.name.startswith(".") and path.name not in ("docs", "tests")
    )  # fmt: skip
    for top in tops:
        for path in sorted(top.rglob("*")):
            if path.suffix in (".py", ".yaml", ".tsv") and path.is_file():
                hashed.update(str(path.relative_to(ROOT)).encode() + b"\0" + path.read_bytes())
    return hashed.hexdigest()[:12]


def make_item(item: Item, folder: Path, state: str) -> str | None:
    """Makes one golden file, whole or not at all.

    Returns:
        Why it could not be made; None if it was.
    """
    target = folder / item.file
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".making-", dir=folder) as work:
        try:
            kept = item.make(Path(work))
        except (RuntimeError, OSError, ValueError) as problem:
            return " ".join(str(problem).split())[:500]
        part = Path(work) / "kept.json"
        part.write_text(json.dumps({MADE_BY: state, **kept}, indent=1) + "\n", encoding="utf-8")
        part.replace(target)
    return None


def made_by(file: Path) -> str | None:
    """The state of the code that made a golden file; None where there is no whole one."""
    try:
        found = json.loads(file.read_text(encoding="utf-8")).get(MADE_BY)
    except (OSError, ValueError):
        return None
    return None if found is None else str(found)
