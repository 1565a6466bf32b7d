"""`cdpr environments`: learning environments, what they are of a robot, and a picture of one."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from cdpr_drake.analyses.front.environments import environment_names, make_environment
from cdpr_drake.cli.completion import robot_words
from cdpr_drake.cli.options import AsJson
from cdpr_drake.cli.terminal import print_json, wide_console
from cdpr_drake.errors import CdprError, OutputFolderError, why_not_read

if TYPE_CHECKING:
    import numpy as np


def environments(
    name: Annotated[
        str | None, typer.Argument(help="Reach, Track, VisualServo or PickAndPlace; default: all.")
    ] = None,
    robot: Annotated[
        str,
        typer.Option(help="Robot by name, or path of a robot file.", autocompletion=robot_words),
    ] = "acrobot_small",
    action: Annotated[
        str, typer.Option(help="What an action sets: rates, tensions or twist.")
    ] = "twist",
    picture: Annotated[
        Path | None,
        typer.Option(help="Write a picture, .png, of the environment after a reset with seed 0."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Lists the Gymnasium environments, with the sizes of action and observation for a robot."""
    if picture is not None and (name is None or picture.suffix != ".png"):
        raise CdprError(
            f"--picture: found {picture} for {name or 'all environments'}; accepted: a .png of one"
        )
    facts = [_facts(one, robot, action) for one in ([name] if name else environment_names())]
    if picture is not None:
        _draw(picture, str(name), robot, action)
    if as_json:
        print_json(facts)
        return
    table = Table(
        title=f"Learning environments of {robot}, by {action}", box=SIMPLE_HEAD, padding=(0, 1),
        pad_edge=False,
    )  # fmt: skip
    for heading in ("name", "actions", "observations", "steps", "of [s]"):
        table.add_column(heading, no_wrap=True)
    table.add_column("the task")
    for one in facts:
        table.add_row(
            one["name"], str(one["actions"]), str(one["observations"]), str(one["steps"]),
            f"{one['period_s']:g}", one["task"],
        )  # fmt: skip
    wide_console().print(table)
    if picture is not None:
        wide_console().print(f"picture: {picture}")


def _facts(name: str, robot: str, action: str) -> dict[str, Any]:
    """What a list of environments shows."""
    env: Any = make_environment(name, robot=robot, action=action)
    task, spec = env.unwrapped.task, env.spec
    return {
        "name": spec.id,
        "robot": task.robot.name,
        "action": action,
        "actions": task.action_size,
        "observations": task.observation_size,
        "steps": spec.max_episode_steps,
        "period_s": task.options.period,
        "reach_m": task.reach,
        "task": _first_line(type(task).__module__),
    }


def _first_line(module: str) -> str:
    """What a task is, as its module says in its first line, without its name."""
    words = (sys.modules[module].__doc__ or "").splitlines()[0]
    return words.partition(": ")[2].rstrip(".")


def _draw(path: Path, name: str, robot: str, action: str) -> None:
    env: Any = make_environment(name, robot=robot, action=action, render_mode="rgb_array")
    env.reset(seed=0)
    _write(path, env.render())


def _write(path: Path, image: np.ndarray) -> None:
    from matplotlib.image import imsave

    try:
        imsave(path, image)
    except OSError as problem:
        raise OutputFolderError(f"{path}: cannot be written: {why_not_read(problem)}") from problem
