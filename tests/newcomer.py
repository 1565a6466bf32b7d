"""Plays the newcomer: `python -m tests.newcomer --out FOLDER`; exit code 1 if a step fails.

Takes the commands and programs of README, first pages, some guides, `cdpr` alone and the examples,
and runs them one by one, each page in an empty folder, with an empty cache of kernels. `--fresh`
begins where the README does: a clone, a new environment, `pip install`. There a step that names an
extra which it needs is played again with it. Each step has a row with its processor time, that of
its own processes included. `said.txt` has all that steps print. `--robot FILE` plays the first
steps with a robot of one's own instead: from `cdpr new` to a rendered servo that arrives, without a
word about other robots.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from cdpr_drake.cli.commands import FIRST_STEPS

ROOT = Path(__file__).parents[1]

PAGES = (
    "README.md", "docs/start.md", "docs/tutorial.md",
    "docs/guides/command.md", "docs/guides/tensions.md", "docs/guides/workspaces.md",
    "docs/guides/stability.md", "docs/guides/planning.md",
)  # fmt: skip
"""What a newcomer reads, in this order."""

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.DOTALL | re.MULTILINE)

TIMEOUT = re.compile(r'(?:^|: |"outcome": ")timeout\b', re.MULTILINE)
"""A run that did not arrive, as commands and programs print it."""

UNKNOWN = re.compile(r"unknown key|No such option|No such command|KeyError|is unknown")
"""A name that is not there."""

LISTS = ("scenarios", "examples", "robots")
"""Commands that list how runs end, and run nothing."""

EXTRA = re.compile(r"pip install '\.\[(\w+)\]'")
"""How messages name the extra that is missing."""

SERVERS = ("studio",)
"""Commands that go on until they are stopped; they are, once they have told their address."""

LONG = {"reproduce": "a quarter of an hour or hours; .ci and the tests have parts of it"}
"""Commands that are not played, and why."""

INSTALLATION = ("pip install", "mkdocs build")
"""Lines with these words need a checkout: `--fresh` plays the first, `.ci/run` the others."""

PATIENCE = 1800.0
"""A step that takes longer is stopped and fails [s]."""

INTERRUPTED = 130


@dataclass(frozen=True, kw_only=True)
class Step:
    """A command or a program of a page.

    Attributes:
        page: Where it is written.
        words: As it is written; of a program its first line.
        program: Source of a Python program; empty for a command.
    """

    page: str
    words: str
    program: str = ""

    def subcommand(self) -> str:
        """Of `cdpr`; empty for programs and for `cdpr` alone."""
        words = shlex.split(self.words, comments=True)
        return words[1] if not self.program and len(words) > 1 else ""


@dataclass(frozen=True, kw_only=True)
class Played:
    """What came of a step.

    Attributes:
        page, words: Of the step.
        processor: Processor time [s].
        wall: Time that passed [s].
        problem: Why it failed, in a line; empty if it did not.
        left_out: Why it was not played; empty if it was.
        extra: That it asked for and was given.
    """

    page: str
    words: str
    processor: float = 0.0
    wall: float = 0.0
    problem: str = ""
    left_out: str = ""
    extra: str = ""


def page_steps(page: str, text: str) -> Iterator[Step]:
    """Commands of a page one by one, then its programs as the one that they are together."""
    programs = []
    for language, code in BLOCK.findall(text):
        if language == "python":
            programs.append(code)
        if language != "sh":
            continue
        for line in code.replace("\\\n", " ").splitlines():
            words = re.sub(r"\s#\s.*", "", line).strip()
            if any(each in words for each in INSTALLATION):
                last = words.rpartition("&& ")[2].removeprefix(".venv/bin/")
                words = last if last.startswith("cdpr ") else ""
            if words:
                yield Step(page=page, words=" ".join(words.split()))
    if programs:
        yield Step(page=page, words=f"programs of {page}", program="\n".join(programs))


def first_steps() -> Iterator[Step]:
    """What `cdpr` alone shows."""
    yield Step(page="cdpr", words="cdpr")
    for words in FIRST_STEPS:
        yield Step(page="cdpr", words=words)


def example_steps(folder: Path) -> Iterator[Step]:
    """The examples: copied, then run."""
    yield Step(page="examples", words="cdpr examples all")
    for path in sorted(folder.glob("*.py")):
        text = path.read_text(encoding="utf-8")
        yield Step(page="examples", words=f"python {path.name}", program=text)


OWN_ROBOT = ROOT / "tests" / "own_robot.yaml"
"""A robot that does not ship."""

SHIPPED_SCENARIOS_OF = ("acrobot", "caroca")
"""Robots of the scenarios that ship; who has another robot must not read of them."""


def robot_steps(robot: Path) -> Iterator[Step]:
    """What the owner of a robot does first: from `cdpr new` to a rendered servo."""
    own, page = "mine.yaml", "own robot"
    program = (
        "import cdpr_drake as cdpr\n"
        f'robot = cdpr.load_robot("{own}")\n'
        'scenario = cdpr.load_scenario("approach.yaml")\n'
        "pose = getattr(scenario, 'initial_pose', None) or scenario.trajectory.start\n"
        "lengths = cdpr.solve_inverse_kinematics(robot, pose).lengths\n"
        "print(cdpr.solve_forward_kinematics(robot, lengths, guess=pose))\n"
        "print(robot.wrench_matrix(pose).shape)\n"
        "print(cdpr.solve_tensions(robot, pose))\n"
        "cdpr.plot(robot).savefig('robot.png')\n"
    )
    words = f"cdpr new robot mine --from {shlex.quote(str(robot))}"
    yield Step(page=page, words=words)
    for words in (f"check {own}", f"static {own}", f"tension {own}"):
        yield Step(page=page, words=f"cdpr {words}")
    yield Step(page=page, words=f"cdpr workspace {own} --kind static --out where")
    yield Step(page=page, words=f"cdpr new scenario approach --robot {own}")
    yield Step(page=page, words=f"programs of {page}", program=program)
    yield Step(page=page, words="cdpr check approach.yaml")
    yield Step(page=page, words="cdpr simulate approach.yaml --out run")


def misleading(robot: Path, said: str) -> str:
    """A shipped robot that is named although the robot is another one; empty: none is."""
    own = robot.read_text(encoding="utf-8", errors="replace").lower() if robot.is_file() else ""
    for name in SHIPPED_SCENARIOS_OF:
        if name in said.lower() and name not in own:
            return f"names {name}, another robot"
    return ""


def template_steps() -> Iterator[Step]:
    """Templates: written, then run."""
    for kind in ("controller", "estimator", "study"):
        yield Step(page="templates", words=f"cdpr new {kind} my_{kind}")
        yield Step(page="templates", words=f"python my_{kind}.py", program=f"import my_{kind}\n")


class Player:
    """Runs steps with an environment, each page in a folder of its own."""

    def __init__(
        self,
        prefix: Path,
        out: Path,
        patience: float = PATIENCE,
        *,
        cache: Path | None = None,
        clone: Path | None = None,
        robot: Path | None = None,
    ) -> None:
        """With the environment at a prefix, below a folder, for so long a step at most [s].

        Kernels are kept in a folder of its own, as a newcomer has none, or in a given one. Extras
        are installed from a clone; without one, a step that needs another extra fails. With a robot
        of one's own, a step that names a robot that ships fails.
        """
        self._bin, self._out, self._patience = prefix / "bin", out, patience
        self._clone, self._robot = clone, robot
        self._variables = os.environ | {
            "MPLBACKEND": "Agg", "COLUMNS": "100", "BROWSER": "true",
            "NUMBA_CACHE_DIR": str(cache or out / "cache"),
            "PATH": f"{self._bin}:{os.environ.get('PATH', '')}",
        }  # fmt: skip

    def play(self, step: Step) -> Played:
        """Runs a step to its end; once more with the extra that it asks for."""
        played, said = self._once(step)
        wanted = EXTRA.search(said) if played.problem and self._clone is not None else None
        if wanted is None:
            return played
        subprocess.run(
            [self._bin / "python", "-m", "pip", "install", "-q", f"{self._clone}[{wanted[1]}]"],
            env=self._variables, check=True,
        )  # fmt: skip
        return replace(self._once(step)[0], extra=wanted[1])

    def _once(self, step: Step) -> tuple[Played, str]:
        """What came of a step, and what it printed."""
        left_out = LONG.get(step.subcommand(), "")
        if left_out:
            return Played(page=step.page, words=step.words, left_out=left_out), ""
        folder = self._out / re.sub(r"\W", "_", step.page)
        folder.mkdir(parents=True, exist_ok=True)
        command = self._command(step, folder)
        streams = [folder / name for name in (".stdout", ".stderr")]
        began = time.monotonic()
        with streams[0].open("w") as out, streams[1].open("w") as err:
            process = subprocess.Popen(
                command, cwd=folder, env=self._variables, stdout=out, stderr=err,
                stdin=subprocess.DEVNULL,
            )  # fmt: skip
            serves = step.subcommand() in SERVERS
            code, used, why = self._end_of(process, streams if serves else [], began)
        said = [path.read_text(encoding="utf-8", errors="replace") for path in streams]
        for path in streams:
            path.unlink()
        with (self._out / "said.txt").open("a", encoding="utf-8") as transcript:
            transcript.write("\n".join([f"\n$ {step.words}   [{step.page}]", *said]))
        why = why or problem_of(step, code, *said)
        if self._robot is not None:
            why = why or misleading(self._robot, "\n".join(said))
        played = Played(
            page=step.page, words=step.words, processor=used, wall=time.monotonic() - began,
            problem=why,
        )  # fmt: skip
        return played, "\n".join(said)

    def _command(self, step: Step, folder: Path) -> list[str]:
        """What is started."""
        if step.program:
            path = folder / (step.words.split()[-1] if " of " not in step.words else "page.py")
            if not path.exists():  # examples and templates were written by the step before
                path.write_text(step.program, encoding="utf-8")
            return [str(self._bin / "python"), path.name]
        words = shlex.split(step.words, comments=True)
        if words[0] != "cdpr":
            raise ValueError(f"{step.page}: {step.words}: found no cdpr; accepted: cdpr ...")
        return [str(self._bin / "cdpr"), *words[1:]]

    def _end_of(
        self, process: subprocess.Popen[bytes], streams: list[Path], began: float
    ) -> tuple[int, float, str]:
        """Exit code, processor time [s], and why it was stopped, if in vain.

        Args:
            process: What runs.
            streams: What it prints, where its address is waited for; else it ends by itself.
            began: When [s].
        """
        why, asked = "", False
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                break
            if streams and not asked and any("http://" in path.read_text() for path in streams):
                process.send_signal(signal.SIGINT)
                asked = True
            if not why and time.monotonic() - began > self._patience:
                why = f"not over after {self._patience:g} s"
                process.terminate()
            time.sleep(0.05)
        process.returncode = os.waitstatus_to_exitcode(status)  # it is waited for
        code = 0 if asked and process.returncode == INTERRUPTED else process.returncode
        return code, usage.ru_utime + usage.ru_stime, why


def problem_of(step: Step, code: int, out: str, err: str) -> str:
    """Why a step failed, in a line; empty if it did not."""
    last = (err.strip() or out.strip()).splitlines()[-1:] or [""]
    if code != 0:
        return f"exit code {code}: {last[0]}"
    if found := UNKNOWN.search(err):
        return f"{found[0]}: {last[0]}"
    if step.subcommand() not in LISTS and TIMEOUT.search(out):
        return 'a run ends by "timeout"'
    return ""


def fresh_environment(out: Path) -> tuple[Path, Played]:
    """Clones what is committed and installs as the README says; prefix, and what that took."""
    clone = out / "clone"
    subprocess.run(["git", "clone", "-q", f"file://{ROOT}", str(clone)], check=True)
    text = (clone / "README.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"<!-- first command -->\n```sh\n(.*?)```", text, re.DOTALL)
    install = block.strip().rpartition(" && ")[0]
    began, before = time.monotonic(), os.times()
    variables = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ended = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", install], cwd=clone, env=variables,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    after = os.times()
    used = after.children_user - before.children_user
    used += after.children_system - before.children_system
    step = Step(page="README.md", words=install)
    problem = problem_of(step, ended.returncode, ended.stdout, ended.stderr)
    os.environ.pop("PYTHONPATH", None)
    return clone / ".venv", Played(
        page=step.page, words=install, processor=used, wall=time.monotonic() - began,
        problem=problem,
    )  # fmt: skip


def table(rows: Sequence[Played]) -> str:
    """Rows as Markdown, the sum of the times below."""
    lines = ["| page | step | processor [s] | |", "| --- | --- | ---: | --- |"]
    for row in rows:
        words, state = row.words.replace("|", "\\|"), row.problem and f"FAILS: {row.problem}"
        state = state or (f"not played: {row.left_out}" if row.left_out else "")
        state += f" with the extra {row.extra}" if row.extra else ""
        lines.append(f"| {row.page} | `{words}` | {row.processor:.1f} | {state} |")
    total = sum(row.processor for row in rows)
    failed = sum(bool(row.problem) for row in rows)
    lines.append(f"\n{len(rows)} steps, {failed} failed, {total:.0f} s of processor time")
    return "\n".join(lines)


def all_steps() -> list[Step]:
    """Everything that is played, in order."""
    steps = list(first_steps())
    for page in PAGES:
        steps += page_steps(page, (ROOT / page).read_text(encoding="utf-8"))
    return [*steps, *example_steps(ROOT / "notebooks" / "examples"), *template_steps()]


def main(given: Sequence[str] | None = None) -> int:
    """Plays, prints the table, and writes it to the folder; 1 if a step failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="an empty or new folder")
    parser.add_argument("--fresh", action="store_true", help="clone and install first")
    parser.add_argument("--only", default="", help="pages whose name has these letters")
    parser.add_argument(
        "--robot", type=Path, help="play the first steps with this robot's file instead of pages"
    )
    options = parser.parse_args(given)
    out = options.out.resolve()
    if out.exists() and any(out.iterdir()):
        parser.error(f"--out: found {out} with files in it; accepted: an empty or new folder")
    out.mkdir(parents=True, exist_ok=True)
    rows, prefix = [], Path(sys.prefix)
    if options.fresh:
        prefix, installed = fresh_environment(out)
        rows.append(installed)
    robot = None if options.robot is None else options.robot.resolve()
    player = Player(prefix, out, clone=prefix.parent if options.fresh else None, robot=robot)
    for step in all_steps() if robot is None else robot_steps(robot):
        if options.only in step.page and not (rows and rows[0].problem and options.fresh):
            rows.append(player.play(step))
            state = "FAILS" if rows[-1].problem else "     "
            print(f"{rows[-1].processor:7.1f} s {state} {step.page}: {step.words}", flush=True)
    shutil.rmtree(out / "cache", ignore_errors=True)
    words = json.dumps([asdict(row) for row in rows], indent=1)
    (out / "newcomer.json").write_text(words, encoding="utf-8")
    (out / "newcomer.md").write_text(table(rows), encoding="utf-8")
    print(table(rows))
    return int(any(row.problem for row in rows))


if __name__ == "__main__":
    sys.exit(main())
