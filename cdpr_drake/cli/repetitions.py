"""`cdpr simulate --seeds`: repeats a visual servo over seeds in several processes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from cdpr_drake.analyses.repetitions import (
    KeptRuns,
    repetition_folder,
    repetition_pictures,
    repetition_table,
    run_many,
    with_seeds,
    write_repetitions,
)
from cdpr_drake.analyses.reporting import WorkProgress, continued_folder, write_pictures
from cdpr_drake.analyses.sweeps import check_scheduler
from cdpr_drake.cli.endings import INCOMPLETE, SayContinued, say_failed, say_kept, shown_path
from cdpr_drake.cli.stop_request import INTERRUPTED, StopRequest
from cdpr_drake.cli.terminal import message_console, print_json, progress_bar, wide_console, working
from cdpr_drake.errors import ScenarioError
from cdpr_drake.models import load_robot
from cdpr_drake.systems.scenarios import Scenario

STOPPING = "Stopping after the runs under way, which are kept; Ctrl-C again drops them"
"""Answer to the first Ctrl-C."""

LARGEST_SEED = 2**31 - 1
MOST_RUNS = 100_000


def parse_seeds(words: str) -> list[int]:
    """Seeds from "0:20" (20 not included) or "3,5,8".

    Raises:
        ScenarioError: It is neither, there are none, or one is there twice.
    """
    span = re.fullmatch(r"(\d{1,10}):(\d{1,10})", words)
    if span and int(span[2]) - int(span[1]) <= MOST_RUNS:
        seeds = list(range(int(span[1]), int(span[2])))
    elif re.fullmatch(r"\d{1,10}(,\d{1,10})*", words):
        seeds = [int(word) for word in words.split(",")]
    else:
        seeds = []
    if not seeds or len(set(seeds)) < len(seeds) or max(seeds) > LARGEST_SEED:
        raise ScenarioError(
            f"--seeds: found {words!r}; accepted: first:end, as 0:20 for 0 to 19, or different "
            f"seeds separated by commas, up to {LARGEST_SEED} and {MOST_RUNS} of them"
        )
    return seeds


def simulate_seeds(
    scenario: Scenario,
    seeds: list[int],
    workers: int | str | None,
    out: Path | None,
    overwrite: bool,
    as_json: bool,
    *,
    formats: Sequence[str],
    note: str,
) -> int:
    """Repeats a scenario, shows where it stands, and writes what came out.

    By so many processes, or by the workers of the Dask scheduler of that address. What was finished
    is kept in the folder whatever ends the program, and found again there.
    """
    count, scheduler = (None, workers) if isinstance(workers, str) else (workers, None)
    if scheduler is not None:
        check_scheduler(scheduler)
    folder = out if out is not None else repetition_folder(scenario)
    console = message_console()
    robot = load_robot(scenario.robot)
    stop = StopRequest(STOPPING)
    with stop.listening(), continued_folder(folder, overwrite) as results:
        kept = KeptRuns(results.path, scenario)
        if note:
            console.print(note)
        with progress_bar(console) as bar:
            task = bar.add_task(scenario.name, total=len(seeds), state="starting processes")

            say_continued = SayContinued(bar.console, folder)

            def show(progress: WorkProgress) -> None:
                say_continued(progress)
                bar.update(
                    task,
                    completed=progress.done,
                    state=f"{progress.done} of {progress.total} runs, "
                    f"{60.0 * progress.speed:.0f} a minute, {progress.what}",
                )

            runs = run_many(
                with_seeds(scenario, seeds), count, show, stop,
                keep_traces=True, kept=kept, scheduler=scheduler,
            )  # fmt: skip
        with working(console, "Writing results"):
            summary = write_repetitions(results.path, scenario, runs, robot)
            folder = shown_path(results.publish())
            failed = write_pictures(folder, repetition_pictures(scenario, runs, formats))
    say_kept(console, results.kept)
    if as_json:
        print_json(summary)
    else:
        printer = wide_console(100)
        printer.print(repetition_table(summary))
        printer.print(f"{summary['wall_time_s']:.1f} s; results: {folder}")
    if runs.interrupted:
        console.print(
            f"Interrupted; {len(runs.records)} of {runs.wanted} runs are in {folder}; the same "
            "command with that --out continues"
        )
        return INTERRUPTED
    if runs.lost:
        dead = ", ".join(map(str, runs.lost))
        console.print(f"cdpr: seed {dead}: the process died, perhaps out of memory")
    return max(say_failed(console, failed, folder, stop), INCOMPLETE if runs.lost else 0)
