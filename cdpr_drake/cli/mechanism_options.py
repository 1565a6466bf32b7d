"""Options of commands that take mechanisms, and what those print."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.cli.terminal import wide_console
from cdpr_drake.errors import CdprError

if TYPE_CHECKING:
    from cdpr_drake.analyses.front.mechanisms import MechanismAtRest, MechanismTensions

NONE = "none"
"""In the place of joints: no joint at all."""

Joint = Annotated[
    list[str] | None,
    typer.Option(
        help="For a mechanism: position of a joint, name=value or name=v1,v2 [rad, m]; repeatable."
    ),
]
Held = Annotated[
    str | None,
    typer.Option(
        help="For a mechanism: joints held by motors, a,b or none; default: those with actuators."
    ),
]


def refuse_for_robots(options: Mapping[str, object]) -> None:
    """Refuses options of mechanisms where a robot with one platform is asked.

    Raises:
        CdprError: One is given; names it.
    """
    _refuse(options, "a robot with one platform", "mechanisms")


def refuse_for_mechanisms(options: Mapping[str, object]) -> None:
    """Refuses options of robots with one platform where a mechanism is asked.

    Raises:
        CdprError: One is given; names it.
    """
    _refuse(options, "a mechanism", "robots with one platform")


def _refuse(options: Mapping[str, object], found: str, accepted: str) -> None:
    given = [f"--{name}" for name, value in options.items() if value]
    if given:
        raise CdprError(f"{', '.join(given)}: found with {found}; accepted: with {accepted}")


def parse_joints(words: list[str] | None) -> dict[str, list[float]]:
    """Positions of --joint by name.

    Raises:
        CdprError: One is no name with numbers.
    """
    found = {}
    for item in words or []:
        name, equals, values = item.partition("=")
        try:
            numbers = [float(value) for value in values.split(",")]
        except ValueError:
            numbers = []
        if not (name.strip() and equals and numbers and np.all(np.isfinite(numbers))):
            raise CdprError(
                f"--joint: found {item!r}; accepted: name=value, or name=v1,v2 [rad, m]"
            )
        found[name.strip()] = numbers
    return found


def parse_names(words: str | None) -> list[str] | None:
    """Joints of --held or --free; None without."""
    if words is None:
        return None
    return [] if words.strip() == NONE else [name.strip() for name in words.split(",")]


def print_rest(found: MechanismAtRest) -> None:
    """Prints a mechanism at rest."""
    console, rest, told = wide_console(120), found.rest, found.as_dict()
    console.print(f"{told['mechanism']} at rest: {rest.stability}")
    table = Table(box=SIMPLE_HEAD, title=f"Cables, {told['model']}, {told['geometry']}")
    for heading in ("cable", "length [m]", "unstrained [m]", "tension [N]"):
        table.add_column(heading, justify="right")
    for k, name in enumerate(found.names):
        table.add_row(
            name,
            f"{found.lengths[k]:.5f}",
            f"{rest.unstrained_lengths[k]:.5f}",
            f"{rest.tensions[k]:.2f}",
        )
    console.print(table)
    for name, values in told["positions"].items():
        console.print(f"{name} [m, rad]: {_words(values)}")
    for name, values in told["held"].items():
        console.print(f"{name} is held with [N, N m]: {_words(values)}")
    words = ", ".join("unstable" if f is None else f"{f:.4g}" for f in told["frequencies_hz"])
    console.print(f"natural frequencies [Hz]: {words}")
    for note in rest.notes:
        console.print(f"note: {note}")


def print_tensions(found: MechanismTensions) -> None:
    """Prints tensions of a mechanism."""
    console, told = wide_console(160), found.as_dict()
    if found.control is None:
        title = f"Tensions [N], {told['geometry']}"
        table = Table(box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True, title=title)
        for heading in ("method", "status"):
            table.add_column(heading, no_wrap=True)
        for name in told["cables"]:
            table.add_column(name, justify="right", no_wrap=True)
        for one in found.solutions:
            cells = [f"{t:.2f}" if np.isfinite(t) else "-" for t in one.tensions]
            table.add_row(one.method, str(one.status), *cells)
        console.print(table)
        _print_shortfall(found)
        return
    console.print(
        f"{told['mechanism']}: {len(told['cables'])} cables for {len(found.rows)} rows that no "
        f"motor holds, of which they control {told['rank']} here: {found.status}; "
        f"{told['geometry']}"
    )
    if told["tensions_n"] is not None:
        pairs: Any = zip(told["cables"], told["tensions_n"], strict=True)
        console.print("tensions [N]: " + ", ".join(f"{name} {t:.2f}" for name, t in pairs))
    console.print("no tensions change, and at rest all of these are zero:")
    for words, off in found.uncontrolled():
        console.print(f"  {words}: {off:.4g}")
    _print_shortfall(found)


def _print_shortfall(found: MechanismTensions) -> None:
    """Prints by how much tensions miss what has to be balanced, if they do."""
    if found.shortfall is not None:
        for label, words in found.shortfall.rows(found.placed.cables.routes.names, found.rows):
            wide_console(160).print(f"{label}: {words}")


def _words(values: list[float]) -> str:
    """Rounded to nanometres or less, so that no -0 is left."""
    return ", ".join(f"{round(value, 9) + 0.0:.6g}" for value in values)
