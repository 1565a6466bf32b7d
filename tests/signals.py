"""Ends commands by signals at random instants, and looks at what is left of them.

    python -m tests.signals --count 20 --seed 0 [--only calibrate,plan] [--minutes 25]

Each command is first run twice, undisturbed: for its duration, and to know which of its bytes are
always the same. Then it is started again and again, and gets SIGTERM, SIGINT (to its whole group,
as from a terminal) or SIGKILL at instants that are spread over the whole run, start and last
moments included. A signal counts if the process was alive when it was sent and was ended by it, or
said so; else it is sent again, earlier. Commands that continue do so in the same folder, and are
killed there again, until they have come to the end. After each signal:

- nothing but what a signal gives is the exit code, and there is no traceback;
- no process of the command is left;
- every file under a final name is whole, and known to be the program's own;
- what is there, and in the end all, has the bytes of the run that nobody ended.

A signal that Python gets while it starts, before the first line of the command, is its own: there
the library may not touch handlers, since it is also imported by programs of others.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from cdpr_drake.analyses.runs.log import PARTS
from tests.left_files import Reference, broken_files, unknown_files

SIGNALS = {"SIGTERM": signal.SIGTERM, "SIGINT": signal.SIGINT, "SIGKILL": signal.SIGKILL}

TOKEN = "CDPR_SIGNALS_TRIAL"
"""Environment variable by which all processes of a trial are known."""

LONGEST = 1200.0
"""A command that has not ended after so long hangs [s]; a busy machine takes minutes."""

LEFT = 120.0
"""Processes that a command started must have ended by so long after it [s]."""

TRIES = 12
"""So often a signal is sent anew that came too late."""

BEFORE_COMMAND = {"__init__.py", "kernel_cache/__init__.py", "kernel_cache/folder.py"}
"""Files of the package that are loaded before the command's own."""

ANSWERED = re.compile(r"^(Stopping|The report is being written)", re.MULTILINE)
"""What a command answers to the first signal."""

ENDED = (130, -signal.SIGINT)
"""Exit codes of what ended by a wish. Python makes the second of the first where the exception went
through an `exec` on its way, as of a dataclass that is just defined; a shell says 130 of both."""

STARTING = 0.3
"""Share of the signals that come before a command says that it is ready, where it says so."""

ROOT = Path(__file__).parent.parent


@dataclass(frozen=True)
class Command:
    """A command that is ended.

    Attributes:
        words: After `cdpr`, without --out; {inputs} stands for the folder of what they read.
        keeps: Whether it works in its folder from the start, so that the same words continue.
        client: Whether a client closes its loop.
        studio: Whether it is a job of the studio.
    """

    words: tuple[str, ...]
    keeps: bool = True
    client: bool = False
    studio: bool = False

    @property
    def tells(self) -> bool:
        """Whether it is seen when it is ready: waits for its client, or has begun its job."""
        return self.client or self.studio


SEEDS = (
    "simulate", "acrobot_pbvs", "--camera", "projected", "--duration", "0.2", "--seeds", "0:2",
)  # fmt: skip

COMMANDS = {
    "seeds": Command((*SEEDS, "--workers", "2")),
    "certify": Command(
        ("workspace", "acrobot_small", "--grid", "3,3,3", "--certify", "--boxes", "300",
         "--workers", "1"),
    ),
    "plan": Command(
        ("plan", "acrobot_large", "--waypoints", "0,0,0.2; 0.05,-0.05,0.25", "--limits", "1,60"),
        keeps=False,
    ),
    "calibrate": Command(
        ("calibrate", "acrobot_small", "{inputs}/poses.csv", "--unknown", "exit_points",
         "--sigma", "lengths=1e-4,place=5e-4,turn=1e-3"),
        keeps=False,
    ),
    "identify": Command(
        ("identify", "acrobot_large", "{inputs}/motion.csv", "--no-pulleys"), keeps=False
    ),
    "study": Command(("study", "workspaces", "--quick", "--workers", "1")),
    "reproduce": Command(
        ("reproduce", "--quick", "--only", "worked-examples", "--workers", "1")
    ),
    "design": Command(
        ("design", "acrobot_large", "--parameters", "{inputs}/design.yaml", "--generations", "2",
         "--boxes", "200"),
    ),
    "serve": Command(
        ("serve", "acrobot_computed_torque", "--set", "integration.engine=compiled",
         "--place", "controller", "--duration", "0.5"),
        keeps=False, client=True,
    ),
    "studio": Command((*SEEDS, "--workers", "1"), studio=True),
}  # fmt: skip


def write_inputs(folder: Path) -> None:
    """What commands read: logs for calibrations and identifications, a file of a design."""
    from tests.analyses.fits import logs
    from tests.cli.commands import write_log
    from tests.identification.logs import log

    write_log(folder / "poses.csv", logs.tracked_columns(1))
    logs.write_motion(folder / "motion.csv", *log(span=4.0, **logs.MOTION_NOISE))
    (folder / "design.yaml").write_text(
        "exit_points: {reach: [0.1, 0.1, 0.1]}\ngoals: [{name: static}]\n"
        "poses: {counts: [3, 3, 2]}\npopulation: 4\n"
    )


JOB = """
import asyncio, signal, sys
from pathlib import Path
from cdpr_drake.studio.jobs import Job

async def main():
    job = Job(sys.argv[2:], Path.cwd())
    job.begin()
    while job._process is None:
        await asyncio.sleep(0.01)
    Path(sys.argv[1]).write_text(str(job._process.pid))
    await job.wait()
    print(job.state, *job.lines, sep="\\n", file=sys.stderr)

signal.signal(signal.SIGINT, signal.SIG_DFL)
asyncio.run(main())
"""
"""A studio with one job, the number of whose process it writes to a file."""


@dataclass
class Tally:
    """What came of one command and signal.

    Attributes:
        hits: Signals that ended the command.
        late: Those that came when it was ending by itself, and were sent again.
        finished: Of the hits, those after which it had all that was asked for.
        whole: How often it was run to the end after signals, and compared.
        early: Hits while Python itself was starting.
        unsent: Signals for which there was no time.
        problems: What was wrong, in words.
        hit_at: Shares of the run at which it was hit.
    """

    hits: int = 0
    late: int = 0
    finished: int = 0
    whole: int = 0
    early: int = 0
    unsent: int = 0
    problems: list[str] = field(default_factory=list)
    hit_at: list[float] = field(default_factory=list)


class Trial:
    """One start of a command."""

    def __init__(self, command: Command, folder: Path, inputs: Path, more: Sequence[str]) -> None:
        """Starts it in a folder."""
        self.token = f"{os.getpid()}-{random.getrandbits(64):x}"
        words = [word.format(inputs=inputs) for word in command.words] + ["--out", "out", *more]
        self._client: subprocess.Popen[bytes] | None = None
        port = _free_port() if command.client else 0
        if command.client:
            words += ["--port", str(port)]
        program = [sys.executable, "-P", "-m", "cdpr_drake", *words]
        self._note = Path(tempfile.mkstemp()[1])
        if command.studio:
            program = [sys.executable, "-P", "-c", JOB, str(self._note), *words]
        environment = {
            **os.environ, TOKEN: self.token, "PYTHONPATH": str(ROOT), "CDPR_COMPILE_HELPERS": "0",
            "CDPR_PROGRESS_PERIOD": "10",
        }  # fmt: skip
        self._said = tempfile.TemporaryFile()  # noqa: SIM115
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            program, cwd=folder, env=environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=self._said, start_new_session=True,
        )  # fmt: skip
        self._studio = command.studio
        if command.client:
            client = str(files("cdpr_drake").joinpath("notebooks/plain_client.py"))
            self._client = subprocess.Popen(
                [sys.executable, client, f"tcp://127.0.0.1:{port}"],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )  # fmt: skip

    def get_ready(self) -> float:
        """Waits until it is ready or has ended; how long that took [s]."""
        while self.process.poll() is None:
            said = os.pread(self._said.fileno(), 2**16, 0)
            if self._note.read_text() if self._studio else b": waiting at " in said:
                break
            time.sleep(0.01)
        return time.monotonic() - self.began

    def send(self, name: str, number: int, kill_studio: bool) -> bool:
        """Sends a signal; whether the process was alive."""
        if self.process.poll() is not None:
            return False
        with suppress(ProcessLookupError):
            if self._studio and not kill_studio:
                words = self._note.read_text()
                if not words:  # it has no job yet
                    os.kill(self.process.pid, number)
                    return True
                os.kill(int(words), number)
            elif name == "SIGINT":
                os.killpg(self.process.pid, number)
            else:
                os.kill(self.process.pid, number)
            return True
        return False

    def end(self, longest: float = LONGEST) -> tuple[int | None, str, float]:
        """Waits for it: exit code, None where it hangs, what it said, and how long it took [s]."""
        try:
            code: int | None = self.process.wait(longest)
        except subprocess.TimeoutExpired:
            code = None
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        took = time.monotonic() - self.began
        if self._client is not None:
            self._client.kill()
            self._client.wait()
        self._said.seek(0)
        said = self._said.read().decode(errors="replace")
        self._said.close()
        return code, said, took

    def left(self) -> list[str]:
        """Processes that are still there after a while, in words; they are ended."""
        given_up = time.monotonic() + LEFT
        while there := list(_processes(self.token)):
            if time.monotonic() > given_up:
                for number, _ in there:
                    with suppress(ProcessLookupError):
                        os.kill(number, signal.SIGKILL)
                return [words for _, words in there]
            time.sleep(0.05)
        self._note.unlink(missing_ok=True)
        return []


def _processes(token: str) -> Iterator[tuple[int, str]]:
    """Processes of a trial that have not ended: number, and command."""
    for entry in os.scandir("/proc"):
        if entry.name.isdecimal():
            with suppress(OSError):
                if f"{TOKEN}={token}".encode() in Path(entry.path, "environ").read_bytes():
                    words = Path(entry.path, "cmdline").read_bytes().replace(b"\0", b" ")
                    if words:  # else it is a zombie
                        yield int(entry.name), words.decode(errors="replace")[:100]


def _free_port() -> int:
    import socket

    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Campaign:
    """All signals to one command."""

    def __init__(
        self, name: str, base: Path, inputs: Path, count: int, seed: int, longest: float
    ) -> None:
        """In a folder of its own; so many signals of each kind, within so long [s] if it lasts."""
        self._until = time.monotonic() + longest
        self.name, self.command = name, COMMANDS[name]
        self._inputs, self._count = inputs, count
        self._random = random.Random(f"{seed} {name}")
        self._base = base / name
        self._folder = self._base / "ended"
        self._tally = {each: Tally() for each in SIGNALS}
        self.duration = self._start_took = 0.0

    def run(self) -> dict[str, Tally]:
        """Sends them all."""
        for name in ("one", "two"):
            (self._base / name).mkdir(parents=True)
            trial = self._start(self._base / name)
            self._start_took = trial.get_ready() if self.command.tells else 0.0
            code, said, self.duration = trial.end()
            if code != 0:
                raise RuntimeError(f"{self.name}: exit code {code} undisturbed: {said[-500:]}")
        self._reference = Reference(self._base / "one" / "out", self._base / "two" / "out")
        first = self._tally["SIGTERM"].problems
        first += [*broken_files(self._base / "one"), *unknown_files(self._base / "one")]
        trials = [
            (each, (number + self._random.random()) / self._count)
            for each in SIGNALS
            for number in range(self._count)
        ]
        self._random.shuffle(trials)
        self._fresh()
        for number, (each, share) in enumerate(trials):
            if time.monotonic() > self._until:
                for name, _ in trials[number:]:
                    self._tally[name].unsent += 1
                break
            known = [len(tally.problems) for tally in self._tally.values()]
            self._hit(each, share)
            if self._random.random() < 0.25:
                self._to_the_end(self._tally[each])
            self._say(known)
        self._to_the_end(self._tally["SIGKILL"])
        return self._tally

    def _say(self, known: Sequence[int]) -> None:
        """Says how many signals hit, and which problems are new, since more may take hours."""
        tallies = self._tally.values()
        new = [
            words
            for number, tally in zip(known, tallies, strict=True)
            for words in tally.problems[number:]
        ]
        print(
            self.name,
            sum(tally.hits for tally in tallies),
            *new,
            sep=": ",
            file=sys.stderr,
            flush=True,
        )

    def _fresh(self) -> None:
        shutil.rmtree(self._folder, ignore_errors=True)
        self._folder.mkdir()

    def _start(self, folder: Path) -> Trial:
        """Starts it; results of one that does not continue are put over those that are there."""
        there = (folder / "out").exists() and not self.command.keeps
        return Trial(self.command, folder, self._inputs, ["--overwrite"] if there else [])

    def _wait(self, trial: Trial, share: float, sooner: float) -> None:
        """Waits for an instant: from the start on, or from when it is ready, where that is seen."""
        begins, lasts = trial.began, self.duration
        if self.command.tells and share < STARTING:
            lasts, share = self._start_took, share / STARTING
        elif self.command.tells:
            self._start_took = trial.get_ready()
            begins, share = time.monotonic(), (share - STARTING) / (1.0 - STARTING)
            lasts = max(self.duration - self._start_took, 0.1 * self.duration)
        while trial.process.poll() is None and time.monotonic() < begins + lasts * share * sooner:
            time.sleep(0.002)

    def _hit(self, name: str, share: float) -> None:
        """Sends one signal, at a share of the run, or earlier where that was too late."""
        tally = self._tally[name]
        for attempt in range(TRIES):
            if attempt and self.command.keeps:
                self._fresh()  # what is finished takes no time any more
            trial = self._start(self._folder)
            self._wait(trial, share, 0.8**attempt)
            at = (time.monotonic() - trial.began) / self.duration
            kill_studio = self._random.random() < 0.5 and name == "SIGKILL"
            alive = trial.send(name, SIGNALS[name], kill_studio)
            code, said, took = trial.end()
            problems = [f"left behind: {words}" for words in trial.left()]
            problems += self._problems(name, code, said)
            tally.problems += [f"at {at:.2f} of the run: {words}" for words in problems]
            by_it = code in (*ENDED, -SIGNALS[name]) or bool(ANSWERED.search(said))
            if self.command.studio:  # which says first how the job ended
                by_it = by_it or not said.startswith("finished")
            if code == 0 and not self.command.studio:
                self.duration = 0.5 * (self.duration + max(took, 0.3 * self.duration))
                tally.finished += by_it
                if not self.command.client:  # of which the log has been compared
                    tally.problems += self._reference.differs(self._folder / "out", whole=True)
            if alive and by_it:
                tally.hits += 1
                tally.hit_at.append(at)
                return
            tally.late += 1
        tally.problems.append(f"no signal of {TRIES} at {share:.2f} of the run hit it")

    def _problems(self, name: str, code: int | None, said: str) -> Iterator[str]:
        """What is wrong after a signal."""
        if code is None:
            yield f"it did not end within {LONGEST:g} s: {said[-200:]!r}"
        elif code not in (0, *ENDED, -SIGNALS[name]) and not self.command.studio:
            yield f"exit code {code}: {said[-300:]!r}"
        if "Traceback" in said or "Exception ignored" in said:
            reached = set(re.findall(r"/cdpr_drake/(\S+)\", line", said.partition("Traceback")[2]))
            if reached - BEFORE_COMMAND or "Traceback" not in said:
                yield f"traceback: {said[-700:]!r}"
            else:
                self._tally[name].early += 1
        yield from broken_files(self._folder)
        yield from unknown_files(self._folder)
        out = self._folder / "out"
        if self.command.client:
            yield from self._check_log()
        elif out.is_dir() and not self.command.keeps:
            yield from self._reference.differs(out, whole=False)
        if any(path.name.startswith("out-kept") for path in self._folder.iterdir()):
            yield "--overwrite took files of the program for somebody else's"
            self._fresh()

    def _check_log(self) -> Iterator[str]:
        """A run that was ended has the beginning of the log of the one that was not."""
        if (self._folder / "out" / PARTS / "layout.json").exists():
            words = [sys.executable, "-P", "-m", "cdpr_drake", "finish", "out"]
            done = subprocess.run(
                words, cwd=self._folder, capture_output=True, text=True,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
            )  # fmt: skip
            if done.returncode not in (0, 2) or "Traceback" in done.stderr:
                yield f"finish: exit code {done.returncode}: {done.stderr[-300:]!r}"
        whole = (self._reference.folder / "log.csv").read_text()
        for log in self._folder.glob("out*/log.csv"):
            rows = log.read_text().splitlines()
            if whole.splitlines()[: len(rows)] != rows:
                yield f"{log.parent.name}/log.csv is not the beginning of that of the whole run"
        self._fresh()

    def _to_the_end(self, tally: Tally) -> None:
        """Runs it without a signal, and compares what it leaves with what it leaves otherwise."""
        code, said, _ = self._start(self._folder).end()
        if code != 0:
            tally.problems.append(f"after signals: exit code {code}: {said[-300:]!r}")
        else:
            tally.problems += [
                f"after signals: {words}"
                for words in (
                    *self._reference.differs(self._folder / "out", whole=True),
                    *broken_files(self._folder),
                    *unknown_files(self._folder),
                )
            ]
            hidden = [path.name for path in self._folder.iterdir() if path.name.startswith(".")]
            if hidden:
                tally.problems.append(f"after signals: {hidden} stay")
        tally.whole += 1
        self._fresh()


def table(found: dict[str, tuple[float, dict[str, Tally]]]) -> str:
    """What came of all commands, in a table and words."""
    lines = [
        f"{'command':10} {'run [s]':>7} {'signal':8} {'hits':>4} {'late':>4} {'early':>5} "
        f"{'unsent':>6} {'finished':>8} {'compared':>8} {'hit at, share of the run':>24} "
        f"{'failures':>8}"
    ]
    for name, (duration, tallies) in found.items():
        for each, tally in tallies.items():
            span = f"{min(tally.hit_at):.2f} to {max(tally.hit_at):.2f}" if tally.hit_at else "-"
            lines.append(
                f"{name:10} {duration:7.1f} {each:8} {tally.hits:4} {tally.late:4} "
                f"{tally.early:5} {tally.unsent:6} {tally.finished:8} {tally.whole:8} {span:>24} "
                f"{len(tally.problems):8}"
            )
    for name, (_, tallies) in found.items():
        for each, tally in tallies.items():
            for words, count in Counter(tally.problems).items():
                lines.append(f"{name} {each}: {words}{f' ({count} times)' if count > 1 else ''}")
    total = [tally for _, tallies in found.values() for tally in tallies.values()]
    lines.append(
        f"{sum(t.hits for t in total)} signals hit, {sum(len(t.problems) for t in total)} failures"
    )
    return "\n".join(lines)


def main(words: Sequence[str] | None = None) -> int:
    """Runs the campaign; 1 where anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--count", type=int, default=20, help="of each signal, to each command")
    parser.add_argument("--only", default=",".join(COMMANDS), help="names, with commas")
    parser.add_argument("--seed", type=int, default=0, help="of the instants")
    parser.add_argument("--at-once", type=int, default=2, help="commands at the same time")
    parser.add_argument(
        "--minutes", type=float, help="longest time, shared by the commands; without it, none"
    )
    parser.add_argument("--keep", type=Path, help="folder to work in, which stays")
    asked = parser.parse_args(words)
    # A shell lets what it starts in the background ignore Ctrl-C, and commands would inherit that.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    names = [name for name in asked.only.split(",") if name]
    if unknown := [name for name in names if name not in COMMANDS]:
        parser.error(f"--only: found {unknown[0]!r}; accepted: {', '.join(COMMANDS)}")
    base = Path(tempfile.mkdtemp(prefix="cdpr-signals-")) if asked.keep is None else asked.keep
    inputs = base / "inputs"
    inputs.mkdir(parents=True)
    write_inputs(inputs)
    found: dict[str, tuple[float, dict[str, Tally]]] = {}
    lock = threading.Lock()

    longest = math.inf
    if asked.minutes is not None:
        longest = 60.0 * asked.minutes * asked.at_once / len(names)

    def one(name: str) -> None:
        campaign = Campaign(name, base, inputs, asked.count, asked.seed, longest)
        began = time.monotonic()
        try:
            tallies = campaign.run()
        except Exception as problem:  # the others go on
            tallies = {each: Tally() for each in SIGNALS}
            tallies["SIGTERM"].problems.append(f"{type(problem).__name__}: {problem}")
        with lock:
            found[name] = campaign.duration, tallies
            print(
                f"{name}: {time.monotonic() - began:.0f} s\n{table({name: found[name]})}",
                file=sys.stderr, flush=True,
            )  # fmt: skip

    with ThreadPoolExecutor(asked.at_once) as pool:
        list(pool.map(one, names))
    ordered = {name: found[name] for name in names}
    print(table(ordered))
    if asked.keep is None:
        shutil.rmtree(base, ignore_errors=True)
    return int(any(tally.problems for _, tallies in ordered.values() for tally in tallies.values()))


if __name__ == "__main__":
    sys.exit(main())
