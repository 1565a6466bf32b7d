"""`cdpr bench`: timings as ratios in one run."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Annotated

import typer
from rich.table import Table

from cdpr_drake.analyses.reporting.timing import TimingRow
from cdpr_drake.cli.completion import words_among
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import message_console, print_json, wide_console
from cdpr_drake.errors import CdprError
from cdpr_drake.schema.typed_yaml import closest

if importlib.util.find_spec("cdpr_drake.analyses.benchmarks") is None:  # as in a wheel
    BENCH_GROUPS: dict[str, Callable[[bool], list[TimingRow]]] = {}
else:
    from cdpr_drake.analyses.benchmarks.groups import BENCH_GROUPS


def bench(
    group: Annotated[
        str | None,
        typer.Argument(
            help="Group of benchmarks; default: all.", autocompletion=words_among(BENCH_GROUPS)
        ),
    ] = None,
    quick: Annotated[bool, typer.Option(help="Fewer repetitions, and no rendering.")] = False,
    as_json: AsJson = False,
) -> None:
    """Times computations against baselines in the same run; needs a source checkout."""
    if not BENCH_GROUPS:
        raise CdprError("bench: found no benchmarks; accepted: an install from a source checkout")
    if group is not None and group not in BENCH_GROUPS:
        raise CdprError(f"benchmark {group!r} is unknown; {closest(group, BENCH_GROUPS)}")
    names = [group] if group is not None else list(BENCH_GROUPS)
    rows: dict[str, list[TimingRow]] = {}
    for name in names:
        with message_console().status(f"Timing {name}"):
            rows[name] = BENCH_GROUPS[name](quick)
    if as_json:
        print_json({name: [row.as_dict() for row in some] for name, some in rows.items()})
        return
    for name, group_rows in rows.items():
        table = Table(title=f"cdpr bench {name}")
        for heading in ("what", "median", "baseline", "its median", "ratio", "meaning"):
            table.add_column(heading)
        for row in group_rows:
            table.add_row(
                row.name,
                f"{_plain(row.value)} {row.unit}",
                row.baseline,
                f"{_plain(row.baseline_value)} {row.unit}",
                f"{row.ratio:.2f}",
                row.ratio_means,
            )
        wide_console().print(table)


def _plain(value: float) -> str:
    """Three digits or more, and no power of ten where it is no small number."""
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.3g}"
