"""Learning environments of a robot: a list of them, and one made ready to be begun."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from cdpr_drake.analyses.frame.result import Listing, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import RobotWord, words
from cdpr_drake.errors import CdprError, OutputFolderError, why_not_read
from cdpr_drake.schema.typed_yaml import closest

BEGIN, END = "cdpr/", "-v0"
"""Before and after the name of a task in Gymnasium's list."""


@verb()
def list_environments(
    name: Annotated[str | None, Parameter(metavar="NAME")] = None, *,
    robot: RobotWord = "acrobot_small", action: str = "twist",
    picture: Annotated[Path | None, words(Path, "the path of a .png", "FILE.png")] = None,
) -> Listing:  # fmt: skip
    """Lists the Gymnasium environments, with the sizes of action and observation for a robot.

    Args:
        name: Reach, Track, VisualServo or PickAndPlace; default: all.
        robot: Robot by name or file.
        action: What an action sets: rates, tensions or twist.
        picture: Write a picture, .png, of the environment after a reset with seed 0.

    Raises:
        CdprError: Gymnasium is not installed; there is no such environment, or an argument is not
            accepted.
        OutputFolderError: The picture cannot be written.
    """
    if picture is not None and (name is None or picture.suffix != ".png"):
        which = name or "all environments"
        raise CdprError(f"picture: found {picture} for {which}; accepted: a .png of one")
    rows = []
    for each in [name] if name else environment_names():
        env = make_environment(each, robot=robot, action=action)
        task, spec = env.unwrapped.task, env.spec
        about = (sys.modules[type(task).__module__].__doc__ or "").splitlines()[0]
        rows.append({
            "name": spec.id, "robot": task.robot.name, "action": action,
            "actions": task.action_size, "observations": task.observation_size,
            "steps": spec.max_episode_steps, "period_s": task.options.period,
            "reach_m": task.reach, "task": about.partition(": ")[2].rstrip("."),
        })  # fmt: skip
    lines = []
    if picture is not None:
        env = make_environment(str(name), robot=robot, action=action, render_mode="rgb_array")
        env.reset(seed=0)
        _write(picture, env.render())
        lines.append(f"picture: {picture}")
    headings = ("name", "actions", "observations", "steps", "of [s]", "the task")
    title = f"Learning environments of {robot}, by {action}"
    return Listing(rows, Table(title, headings, [
        (row["name"], str(row["actions"]), str(row["observations"]), str(row["steps"]),
         f"{row['period_s']:g}", row["task"])
        for row in rows
    ]), lines)  # fmt: skip


def _write(path: Path, image: Any) -> None:
    from matplotlib.image import imsave

    try:
        imsave(path, image)
    except OSError as problem:
        raise OutputFolderError(f"{path}: cannot be written: {why_not_read(problem)}") from problem


def environment_names() -> list[str]:
    """Names of the environments, as `gymnasium.make` takes them.

    Raises:
        CdprError: Gymnasium is not installed.
    """
    registered: Any = import_module("cdpr_drake.gym")
    return [f"{BEGIN}{name}{END}" for name in registered.STEPS]


def make_environment(name: str, count: int | None = None, **options: Any) -> Any:
    """A learning environment: `gymnasium.make`, or `make_vec` for many robots at once.

        envs = cdpr.make_environment("Reach", 256, robot="caroca", action="twist")

    Args:
        name: Reach, Track, VisualServo or PickAndPlace, with or without what Gymnasium's list has
            round it, as in cdpr/Reach-v0.
        count: Number of robots, moved by one compiled call; None: one, alone.
        options: Fields of the task's options, such as robot, action, randomise; render_mode.

    Returns:
        A `gymnasium.Env`, or of many a `gymnasium.vector.VectorEnv`.

    Raises:
        CdprError: Gymnasium is not installed; there is no such environment, or an option is not
            accepted.
    """
    names = environment_names()
    full = name if name.startswith(BEGIN) else f"{BEGIN}{name}{END}"
    if full not in names:
        short = [each.removeprefix(BEGIN).removesuffix(END) for each in names]
        raise CdprError(f"environment {name!r} is unknown; {closest(name, short)}")
    if count is not None and count < 1:
        raise CdprError(f"count: found {count}; accepted: 1 or more")
    gymnasium: Any = import_module("gymnasium")
    if count is None:
        return gymnasium.make(full, **options)
    return gymnasium.make_vec(full, num_envs=count, **options)
