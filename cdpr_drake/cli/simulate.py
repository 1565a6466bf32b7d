"""`cdpr simulate`: runs a scenario, repeats it over seeds, or compares reactions to a break."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from cyclopts import Parameter
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.frame.follow import NOBODY, Follow
from cdpr_drake.analyses.frame.words import (
    Formats,
    Host,
    Names,
    OutFolder,
    Overrides,
    Port,
    ScenarioWord,
    Workers,
    one_of,
    words,
)
from cdpr_drake.analyses.front.failures import BreakReactions, compare_reactions
from cdpr_drake.analyses.front.simulation import RepeatedRuns, Run, continue_run, finish_run
from cdpr_drake.analyses.front.simulation import simulate as run_scenario
from cdpr_drake.analyses.reporting.exported_logs import checked_log_formats
from cdpr_drake.analyses.reporting.folder_lock import free_folder
from cdpr_drake.analyses.reporting.output_folder import shown_path
from cdpr_drake.analyses.simulation.live_control import Steering
from cdpr_drake.analyses.simulation.live_messages import open_connection
from cdpr_drake.analyses.simulation.monte_carlo_report import repetition_table
from cdpr_drake.analyses.simulation.monte_carlo_store import repetition_folder
from cdpr_drake.analyses.simulation.scenario_kinds import SCENARIO_KINDS, ScenarioKind
from cdpr_drake.analyses.visualization.live_view import Prepare
from cdpr_drake.analyses.visualization.meshcat_window import LOCAL, open_meshcat, page_address
from cdpr_drake.cli.option_names import named_options
from cdpr_drake.cli.process import CLIENT_ENDED, INCOMPLETE, INTERRUPTED, StopRequest
from cdpr_drake.cli.sessions import Answer, FollowedSession, failures, refuse
from cdpr_drake.systems.diagrams.load import load_scenario
from cdpr_drake.systems.loops.loop_choice import set_loop
from cdpr_drake.systems.monitoring.run_monitor import Outcome
from cdpr_drake.systems.scenarios.files import scenario_kind
from cdpr_drake.systems.scenarios.visual_servo_scenario import DEFAULT_SCENARIO

LARGEST_SEED = 2**31 - 1
MOST_RUNS = 100_000

PYTHON_NAMES = {
    "camera.kind=projected": "--camera projected", "finish_run": "cdpr simulate --finish",
    "continue_run": "cdpr simulate --continue", "descriptor": "--steered-by",
}  # fmt: skip
"""Options by what messages of the library say to callers in Python."""


def seeds_of(word: str) -> list[int]:
    """Seeds of 0:20, where 20 is not included, or of 3,5,8."""
    span = re.fullmatch(r"(\d{1,10}):(\d{1,10})", word)
    if span and int(span[2]) - int(span[1]) <= MOST_RUNS:
        seeds = list(range(int(span[1]), int(span[2])))
    elif re.fullmatch(r"\d{1,10}(,\d{1,10})*", word):
        seeds = [int(part) for part in word.split(",")]
    else:
        seeds = []
    if not seeds or len(set(seeds)) < len(seeds) or max(seeds) > LARGEST_SEED:
        raise ValueError(word)
    return seeds


Seeds = Annotated[
    Sequence[int] | None,
    words(seeds_of, "first:end, as 0:20 for 0 to 19, or different seeds separated by commas, up to "
          f"{LARGEST_SEED} and {MOST_RUNS} of them", "FIRST:END|SEED,..."),
]  # fmt: skip
LogFormats = Annotated[
    Sequence[str],
    words(lambda word: checked_log_formats([part.strip() for part in word.split(",")]),
          "mat, parquet, or both with a comma", "FORMAT,...", name="--log-format"),
]  # fmt: skip


def simulate(
    scenario: ScenarioWord = DEFAULT_SCENARIO, /, *, out: OutFolder = None,
    camera: Annotated[str | None, one_of(("rendered", "projected"))] = None,
    duration: float | None = None, seed: int | None = None, seeds: Seeds = None,
    workers: Workers = None, overrides: Overrides = (), overwrite: bool = False,
    formats: Formats = ("png",), video: bool = False, finish: Path | None = None,
    resume: Annotated[Path | None, Parameter(name="--continue")] = None,
    log_rate: float | None = None, log_formats: LogFormats = (), meshcat: bool = False,
    host: Host = None, port: Port = None,
    cable: Annotated[int | None, Parameter(name="--compare-reactions")] = None,
    time: Annotated[float | None, Parameter(name="--break-time")] = None,
    after: float | None = None, reactions: Names | None = None,
    steered_by: Annotated[int | None, Parameter(show=False)] = None,
    follow: Annotated[Follow, Parameter(parse=False)] = NOBODY,
) -> Answer:  # fmt: skip
    """Simulates a scenario and writes summary, log, figures and replay.

    Args:
        scenario: Scenario by name, path of a YAML file, or folder of a run, to repeat it.
        out: Results folder; default: a new one below runs/.
        camera: Images of a renderer, or the target's corners by projection.
        duration: Longest simulated time [s].
        seed: Seed of noise and random directions.
        seeds: Repeats the run over seeds, as 0:20 (0 to 19) or 3,5,8.
        workers: Processes for --seeds, or a Dask scheduler; default: one for each processor, for
            long work.
        overrides: Key and value of the scenario, such as controller.lambda_0=1.5.
        overwrite: Replace results in the folder.
        formats: Files of each figure: png, pdf, svg, or several, as png,pdf.
        video: Render camera.mp4 too.
        finish: Folder of a killed run: write log, summary and figures of what it left.
        resume: Folder of a killed run: continue it from its last checkpoint.
        log_rate: Rows of the log per second [Hz]; long runs need few.
        log_formats: The log also as mat (MATLAB) or parquet, or both: mat,parquet; log.csv and
            log.npz are always there.
        meshcat: Show the run in a browser, at real time at most.
        host: With --meshcat: name or address of this machine at which Meshcat listens, * for all;
            default: only this machine can connect.
        port: With --meshcat: its port; default: a free one from 7000 to 7099.
        cable: Number of a cable, from 0: break it once for each reaction and compare the runs; goes
            with --set, --camera, --seed and --out.
        time: With --compare-reactions: time of the break [s]; default: 1.
        after: With --compare-reactions: time simulated after the break [s]; default: 2.
        reactions: With --compare-reactions: one or several of none, stop, redistribute, found,
            continue, brake, retreat, descend, with commas; default: all.
        steered_by: Open socket of the program that follows and steers it.
        follow: Who follows.
    """
    values = dict(locals())
    of_scenario = (("camera.kind", camera), ("seed", seed), ("duration", duration),
                   ("log_rate", log_rate))  # fmt: skip
    items = [*overrides, *(f"{key}={value}" for key, value in of_scenario if value is not None)]
    with named_options(PYTHON_NAMES):
        if finish is not None or resume is not None:
            name, option = ("resume", "--continue") if resume else ("finish", "--finish")
            refuse(simulate, values, f"with {option}; accepted: --figure-format, --log-format and "
                   "--video", accepted=(name, "formats", "log_formats", "video"))  # fmt: skip
            session = RunSession(follow, finish or resume)
            left: dict[str, Any] = {
                "formats": formats, "log_formats": log_formats, "video": video, "session": session,
            }  # fmt: skip
            if resume is not None:
                return run_answer(continue_run(resume, **left), session)
            assert finish is not None
            return _finished(finish_run(finish, **left), session)
        of_break = ("time", "after", "reactions")
        if cable is not None:
            refuse(simulate, values, "with --compare-reactions; accepted: without", accepted=(
                "scenario", "cable", "overrides", "camera", "seed", "out", "overwrite", "formats",
                *of_break,
            ))  # fmt: skip
            return _reactions(
                RunSession(follow), scenario, cable, out, overrides=items, formats=formats,
                overwrite=overwrite,
                **{name: values[name] for name in of_break if values[name] is not None},
            )  # fmt: skip
        _check_options(scenario, values)
        loaded = load_scenario(scenario, items)
        if seeds is not None:
            folder = out if out is not None else repetition_folder(set_loop(loaded, True)[0])
            many = FollowedSession(follow, folder)
            runs = run_scenario(
                loaded, folder=folder, seeds=seeds, workers=workers, overwrite=overwrite,
                formats=formats, session=many,
            )  # fmt: skip
            return _repeated(runs, many)
        folder = out if out is not None else free_folder(Path("runs") / loaded.name)
        listens = (host or LOCAL, port) if meshcat else None
        session = RunSession(follow, folder, listens, steered_by)
        run = run_scenario(
            loaded, folder=folder, overwrite=overwrite, formats=formats, log_formats=log_formats,
            video=video, session=session,
        )  # fmt: skip
        return run_answer(run, session, duration)


def _check_options(scenario: str, values: Mapping[str, Any]) -> None:
    """Refuses options that do not go with a scenario, or not together."""
    kind = SCENARIO_KINDS[scenario_kind(scenario)]

    def refused(beside: str, *names: str) -> None:
        refuse(simulate, values, beside, names=names)

    refused("alone; accepted: with --compare-reactions", "time", "after", "reactions")
    if not kind.has_camera:
        refused(f"with {scenario}, which has no camera; accepted: without", "camera", "video")
    if not kind.is_servo:
        refused(f"with {scenario}; accepted: with visual servos", "video", "seeds")
    if kind.live is None:
        refused(f"with the kind {scenario_kind(scenario)}; accepted: with kinds that move a robot; "
                "replay.html shows the run afterwards", "meshcat", "steered_by")  # fmt: skip
    if not values["meshcat"]:
        refused("alone; accepted: with --meshcat", "host", "port")
    elif values["steered_by"] is not None:
        refused("together; accepted: one of them", "meshcat", "steered_by")
    if values["seeds"] is None:
        refused("alone; accepted: with --seeds", "workers")
    else:
        refused("with --seeds; accepted: without", "seed", "video", "log_formats", "meshcat",
                "steered_by")  # fmt: skip


class RunSession(FollowedSession):
    """Who follows a run; perhaps Meshcat, or a program that steers it."""

    def __init__(
        self, follow: Follow, folder: Path | None = None,
        listens: tuple[str, int | None] | None = None, steered_by: int | None = None,
    ) -> None:  # fmt: skip
        """Of a run.

        Args:
            follow: Who follows.
            folder: Where results go.
            listens: Host and port of Meshcat, if it is wanted.
            steered_by: The open socket of a program that steers it.
        """
        super().__init__(follow, folder)
        self.watched = listens is not None
        self._listens, self._steered_by = listens, steered_by

    def prepare(self, kind: ScenarioKind, scenario: Any) -> Prepare | None:
        """Opens Meshcat and says where, or lets who holds the other end of a socket steer."""
        self.total = scenario.duration
        if self._steered_by is not None:
            connection, request = open_connection(self._steered_by), self.follow.stop
            assert isinstance(request, StopRequest)
            return Steering(scenario, connection, should_stop=request, ask_stop=request.ask).prepare
        if self._listens is None:
            return None
        host, port = self._listens
        meshcat = open_meshcat(host, port)
        self.say(f"{scenario.name} at {page_address(meshcat, host)}")
        return None if kind.live is None else kind.live(scenario, meshcat)


def run_answer(run: Run, session: FollowedSession, duration: float | None = None) -> Answer:
    """What a run did, with the exit code; `duration` is what was asked for [s]."""
    answer, result = _finished(run, session, duration), run.result
    where = f"{result.sim_time:g} s of simulated time"
    folder = _shown(run.folder)
    if result.outcome == Outcome.INTERRUPTED:
        again = f"; to go on: cdpr simulate --continue {shlex.quote(str(folder))}"
        words = f"Interrupted at {where}; what was simulated is in {folder}{again * run.goes_on}"
        return replace(answer, code=INTERRUPTED, words=(words, *answer.words), failed={})
    if result.outcome == Outcome.CLIENT_ENDED and answer.code != INTERRUPTED:
        words = f"cdpr: the run ended at {where}: {result.message}; what was simulated is in "
        return replace(answer, code=CLIENT_ENDED, words=(f"{words}{folder}", *answer.words))
    return answer


def _finished(run: Run, session: FollowedSession, duration: float | None = None) -> Answer:
    """What results of a run were written."""
    summary, folder = run.numbers, _shown(run.folder)
    end = summary["outcome"]
    if duration is not None and run.result.outcome == Outcome.TIMEOUT:
        end = f"ended at {summary['sim_time_s']:g} s, as asked"
    table = Table(title=f"{summary['scenario']}: {end}", show_header=False)
    factor = summary["realtime_factor"] or 0.0
    table.add_row("simulated", f"{summary['sim_time_s']:.2f} s, {factor:.1f} x real time")
    table.add_row("cables", summary["geometry"])
    for row in run.facts():
        table.add_row(*row)
    for remark in summary.get("remarks", ()):
        table.add_row("remark", remark)
    table.add_row("results", str(folder))
    if summary["message"]:
        table.add_row("message", summary["message"])
    return Answer(
        numbers=summary, printed=[table], words=_missing(run.failed, folder, session),
        code=INTERRUPTED if session.stop() else 0, failed=failures(run.failed, folder),
        drawing=run.plot,
    )  # fmt: skip


def _missing(failed: Any, folder: Path, session: FollowedSession) -> list[str]:
    return [*session.kept(), *([f"The data is complete in {folder}"] if failed else [])]


def _shown(folder: Path | None) -> Path:
    assert folder is not None
    return shown_path(folder)


def _repeated(repeated: RepeatedRuns, session: FollowedSession) -> Answer:
    """What runs over seeds did."""
    folder, runs = _shown(repeated.folder), repeated.runs
    words, code = _missing(repeated.failed, folder, session), 0
    if runs.interrupted:
        words.append(
            f"Interrupted; {len(runs.records)} of {runs.wanted} runs are in {folder}; the same "
            "command with that --out continues"
        )
        code = INTERRUPTED
    elif runs.lost:
        dead = ", ".join(map(str, runs.lost))
        words.append(f"cdpr: seed {dead}: the process died, perhaps out of memory")
        code = INCOMPLETE
    if session.stop():
        code = INTERRUPTED
    took = f"{repeated.numbers['wall_time_s']:.1f} s; results: {folder}"
    return Answer(
        numbers=repeated.numbers, printed=[repetition_table(repeated.numbers), took], words=words,
        code=code, failed=failures(repeated.failed, folder), drawing=repeated.plot,
    )  # fmt: skip


def _reactions(
    session: FollowedSession, scenario: str, cable: int, out: Path | None, **more: Any
) -> Answer:
    """What reactions to a broken cable are worth."""
    compared = compare_reactions(scenario, cable, folder=out, session=session, **more)
    folder = None if out is None else shown_path(out.resolve())
    printed = [_reaction_table(compared)] if folder is None else [
        _reaction_table(compared), f"results: {folder}"
    ]  # fmt: skip
    words = [] if folder is None else _missing(compared.failed, folder, session)
    return Answer(
        numbers=compared.as_dict(), printed=printed, words=words,
        failed=failures(compared.failed, folder), drawing=compared.plot,
    )  # fmt: skip


def _reaction_table(compared: BreakReactions) -> Table:
    title = f"{compared.scenario}: {compared.cable} breaks at {compared.time:g} s"
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("reaction", no_wrap=True)
    for heading in (
        "excursion [mm]", "turn [deg]", "speed [m/s]", "tension [N]", "slack [s]", "at rest [s]",
    ):  # fmt: skip
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("ends")
    for name, row in compared.rows.items():
        out = f", leaves the frame at {row['impact_m_s']:.2f} m/s" if row["leaves"] else ""
        table.add_row(
            name, f"{1e3 * row['excursion_m']:.1f}", f"{np.degrees(row['turn_rad']):.1f}",
            f"{row['largest_speed_m_s']:.3f}", f"{row['tension_n']:.1f}", f"{row['slack_s']:.2f}",
            f"{row['rest_s']:.2f}", row["outcome"] + out,
        )  # fmt: skip
    return table
