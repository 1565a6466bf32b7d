"""Options that several subcommands have, and what their words mean."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.cli.completion import robot_words
from cdpr_drake.cli.option_names import with_options
from cdpr_drake.errors import CdprError, OutputFolderError, accepted_names, why_not_read
from cdpr_drake.geometry.poses import pose_from_angles

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cdpr_drake.models.robot_schema import Robot

RobotName = Annotated[
    str,
    typer.Argument(help="Robot by name, or path of a robot file.", autocompletion=robot_words),
]
Wrench = Annotated[
    str | None,
    typer.Option(
        help="Wrench on the platform in addition to its weight, about Po, in W, moments first: "
        "mx,my,mz,fx,fy,fz [N m, N]."
    ),
]
Limits = Annotated[
    str | None, typer.Option(help="Tension limits lower,upper [N], instead of the robot's.")
]
Pulleys = Annotated[
    bool,
    typer.Option(help="Take the robot's pulleys into account; --no-pulleys ignores them."),
]
Mass = Annotated[float | None, typer.Option(help="Mass of the platform [kg].")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
ResultsAsJson = Annotated[bool, typer.Option("--json", help="Print the results as JSON.")]
FigureFormats = Annotated[
    str,
    typer.Option("--format", help="Files of each figure: png, pdf, svg, or several, as png,pdf."),
]
FORMATS = ("png", "pdf", "svg")
Overwrite = Annotated[bool, typer.Option(help="Replace results in the folder.")]
Host = Annotated[
    str | None,
    typer.Option(
        help="Name or address of this machine at which Meshcat listens, * for all; default: "
        "only this machine can connect."
    ),
]
Port = Annotated[
    int | None, typer.Option(help="Port of Meshcat; default: a free one from 7000 to 7099.")
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        help="Dask scheduler whose workers compute, tcp://host:port; default: this machine."
    ),
]
RunsFrom = Annotated[
    Path | None,
    typer.Option(
        help="Results folder by an earlier version of the code, whose runs of the same cases are "
        "taken over; the results say so."
    ),
]
LISTENING = {"host": "--host", "port": "--port"}
"""Options by the arguments of what listens."""
POSE = typer.Option(
    help="Pose of the platform, x,y,z [m] or x,y,z,phi,theta,psi [m, deg]; default: its home."
)


@contextmanager
def named_options(options: Mapping[str, str]) -> Iterator[None]:
    """Says options where what is refused inside the block says Python's arguments.

    Args:
        options: Options by the words for arguments, as `with_options` takes them.
    """
    try:
        yield
    except CdprError as problem:
        problem.args = tuple(
            with_options(words, options) if isinstance(words, str) else words
            for words in problem.args
        )
        raise


def parse_numbers(option: str, words: str, sizes: tuple[int, ...], meaning: str) -> list[float]:
    """Finite numbers separated by commas.

    Args:
        option: Name of the option, for the message.
        words: What the user wrote.
        sizes: How many numbers are accepted.
        meaning: Words that explain them, for the message.

    Raises:
        CdprError: They are not numbers, not finite, or too many or too few.
    """
    try:
        values = [float(word) for word in words.split(",")]
    except ValueError:
        values = []
    if len(values) not in sizes or not all(math.isfinite(value) for value in values):
        raise CdprError(f"{option}: found {words!r}; accepted: {meaning}")
    return values


def pose_or_home(words: str | None, robot: Robot) -> RigidTransform:
    """X_WP of --pose, or the robot's home pose without; raises as `parse_numbers`."""
    return robot.home.transform() if words is None else parse_pose(words)


def parse_pose(words: str, option: str = "--pose") -> RigidTransform:
    """X_WP of --pose or another option; raises as `parse_numbers`."""
    numbers = parse_numbers(option, words, (3, 6), "x,y,z [m] or x,y,z,phi,theta,psi [m, deg]")
    return pose_from_angles(np.array(numbers[:3]), np.radians(numbers[3:] or [0.0, 0.0, 0.0]))


def parse_formats(words: str) -> tuple[str, ...]:
    """Formats of --format, each once.

    Raises:
        CdprError: There is none, or one that is not accepted.
    """
    found = tuple(dict.fromkeys(word.strip().lower() for word in words.split(",")))
    if not set(found) <= set(FORMATS):
        accepted = ", ".join(FORMATS)
        raise CdprError(f"--format: found {words!r}; accepted: {accepted}, or several with commas")
    return found


def parse_wrench(words: str | None) -> Array | None:
    """The wrench of --wrench, shape (6,) [N m, N]; None without; raises as `parse_numbers`."""
    if words is None:
        return None
    return np.array(parse_numbers("--wrench", words, (6,), "mx,my,mz,fx,fy,fz [N m, N]"))


def parse_limits(words: str | None) -> tuple[float, float] | None:
    """Smallest and largest tension of --limits [N]; None without; raises as `parse_numbers`."""
    if words is None:
        return None
    low, high = parse_numbers("--limits", words, (2,), "lo,hi [N]")
    return low, high


PICTURES = (
    ".png",
    ".pdf",
    ".svg",
    ".jpg",
    ".jpeg",
    ".tif",
    ".tiff",
    ".webp",
    ".eps",
    ".ps",
    ".pgf",
)
"""Endings of files that pictures of --plot are written as."""


def check_plots(*paths: Path | None) -> None:
    """Refuses files of --plot before anything is computed or written; None: none is asked for.

    Raises:
        OutputFolderError: The ending is no picture's, or there is no such folder.
    """
    for path in paths:
        if path is None:
            continue
        if path.suffix.lower() not in PICTURES:
            found = f"the ending {path.suffix}" if path.suffix else "no ending"
            raise OutputFolderError(f"{path}: found {found}; accepted: {', '.join(PICTURES)}")
        if not path.parent.is_dir():
            raise OutputFolderError(f"{path}: cannot be written: there is no folder {path.parent}")


def save_plot(figure: Figure, path: Path) -> None:
    """Writes the figure of --plot.

    Raises:
        OutputFolderError: It cannot be written.
    """
    from cdpr_drake.analyses.visualization.figure_files import save_figure

    try:
        save_figure(figure, path)
    except (OSError, ValueError) as problem:
        raise OutputFolderError(f"{path}: cannot be written: {why_not_read(problem)}") from problem


def named_values(
    option: str, words: str | None, names: list[str] | None = None
) -> dict[str, float]:
    """Numbers above 0 by name, from name=number with commas; of shares also 0.

    Raises:
        CdprError: A word is not so, or a name is not among those accepted.
    """
    found = {}
    for item in [] if words is None else words.split(","):
        name, mark, value = item.strip().partition("=")
        try:
            number = float(value)
        except ValueError:
            number = -1.0
        shares = name.endswith("_share")
        if not mark or not (0.0 < number < 1e30 or (shares and number == 0.0)):
            raise CdprError(f"{option}: found {item.strip()!r}; accepted: name=number > 0")
        if names is not None and name not in names:
            raise CdprError(f"{option}: found {name!r}; {accepted_names(name, names)}")
        found[name] = number
    return found
