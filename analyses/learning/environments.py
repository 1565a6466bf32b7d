"""The tasks as environments of Gymnasium, single and many at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from cdpr_drake.analyses.learning.robot_picture import RobotPicture
from cdpr_drake.analyses.learning.robot_task import MOST, RobotTask
from cdpr_drake.analyses.learning.task_table import TASKS, make_task
from cdpr_drake.analyses.learning.visual_servo_task import VisualServoTask
from cdpr_drake.errors import CdprError

RENDER_MODES = ("rgb_array",)
"""How `render` shows robots."""


def action_space(task: RobotTask) -> gymnasium.spaces.Box:
    """Actions of one robot."""
    return gymnasium.spaces.Box(-1.0, 1.0, (task.action_size,), np.float32)


def observation_space(task: RobotTask) -> gymnasium.spaces.Box:
    """Observations of one robot."""
    shape = task.image_shape() if isinstance(task, VisualServoTask) else None
    if shape is not None:
        return gymnasium.spaces.Box(0, 255, shape, np.uint8)
    return gymnasium.spaces.Box(-MOST, MOST, (task.observation_size,), np.float32)


class RobotEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """One robot with a task; `gymnasium.make("cdpr/Reach-v0", robot="caroca")`.

    Attributes:
        task: The task.
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES)}  # noqa: RUF012

    def __init__(self, task: str, render_mode: str | None = None, **options: Any) -> None:
        """A task of `TASKS` with the fields of its `Options`.

        Args:
            task: Its name.
            render_mode: "rgb_array": `render` gives pictures; None: it gives none.
            options: The fields.

        Raises:
            CdprError: As `make_task`, or `render_mode` is another one.
        """
        _check(render_mode)
        self.task = make_task(task, 1, **options)
        self.render_mode = render_mode
        self.metadata = _metadata(self.metadata, self.task)
        self._picture: RobotPicture | None = None
        self.action_space = action_space(self.task)
        self.observation_space = observation_space(self.task)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins an episode."""
        super().reset(seed=seed)
        self.task.begin([0], [self.np_random])
        return self.task.observations()[0], self._info()

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Moves on by a period."""
        self.task.step(np.asarray(action)[None])
        lost = bool(self.task.lost[0])
        reward = float(self.task.rewards[0])
        return self.task.observations()[0], reward, lost, False, self._info()

    def render(self) -> np.ndarray | None:
        """A picture of the robot now, shape (height, width, 3), 8 bits; None without rendering.

        Raises:
            RenderingError: This machine cannot render.
        """
        if self.render_mode is None:
            return None
        if self._picture is None:
            self._picture = RobotPicture(self.task)
        return self._picture.draw(0)

    def _info(self) -> dict[str, Any]:
        return {name: values[0].item() for name, values in self.task.infos().items()}


class RobotVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """Many robots with a task; `gymnasium.make_vec("cdpr/Reach-v0", num_envs=256)`.

    Each does what `RobotEnv` does alone with its seed, to the last bit. An episode that has ended
    is begun anew by the next step, which ignores that action: `AutoresetMode.NEXT_STEP`.

    Attributes:
        task: The task.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": list(RENDER_MODES), "autoreset_mode": AutoresetMode.NEXT_STEP
    }  # fmt: skip

    def __init__(
        self,
        task: str,
        num_envs: int = 1,
        max_episode_steps: int | None = None,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        """A task of `TASKS` with the fields of its `Options`.

        Raises:
            CdprError: As `RobotEnv`.
        """
        _check(render_mode)
        self.task = make_task(task, num_envs, **options)
        self.render_mode = render_mode
        self.metadata = _metadata(self.metadata, self.task)
        self._picture: RobotPicture | None = None
        self.num_envs = num_envs
        self._most = TASKS[task].steps if max_episode_steps is None else max_episode_steps
        self.single_action_space = action_space(self.task)
        self.single_observation_space = observation_space(self.task)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._randoms: list[np.random.Generator] = []
        self._steps, self._over = np.zeros(num_envs, int), np.zeros(num_envs, bool)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begins an episode of every robot.

        Args:
            seed: Of the first robot; the next has the next seed, as of `SyncVectorEnv`. Or one for
                each; None: random numbers go on.
            options: Not read.

        Raises:
            CdprError: There is another number of seeds than of robots.
        """
        seeds: Sequence[int | None]
        if seed is None or isinstance(seed, int | np.integer):
            seeds = [None if seed is None else int(seed) + k for k in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise CdprError(f"seed: found {len(seeds)} seeds; accepted: one, or {self.num_envs}")
        fresh = not self._randoms
        if fresh:
            self._randoms = [seeding.np_random(one)[0] for one in seeds]
        else:
            for k, one in enumerate(seeds):
                if one is not None:
                    self._randoms[k] = seeding.np_random(one)[0]
        self.task.begin(range(self.num_envs), self._randoms)
        self._steps[:], self._over[:] = 0, False
        return self.task.observations(), self._infos()

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Moves all robots on by a period, and begins anew what was over."""
        if not self._randoms:
            raise gymnasium.error.ResetNeeded("Cannot call env.step() before calling env.reset()")
        begun = np.flatnonzero(self._over)
        taken = np.where(self._over[:, None], 0.0, np.asarray(actions, float))
        self.task.step(taken, self._over)
        rewards, lost = self.task.rewards.copy(), self.task.lost.copy()
        self._steps += 1
        if len(begun):
            self.task.begin(begun.tolist(), [self._randoms[k] for k in begun])
            rewards[begun], lost[begun], self._steps[begun] = 0.0, False, 0
        late = self._steps >= self._most
        self._over = lost | late
        return self.task.observations(), rewards, lost, late, self._infos()

    def render(self) -> tuple[np.ndarray, ...] | None:
        """Pictures of all robots, as `RobotEnv.render`."""
        if self.render_mode is None:
            return None
        if self._picture is None:
            self._picture = RobotPicture(self.task)
        return tuple(self._picture.draw(row) for row in range(self.num_envs))

    def _infos(self) -> dict[str, Any]:
        """Numbers of all robots, each with a mask that all have them, as of `SyncVectorEnv`."""
        infos: dict[str, Any] = {}
        for name, values in self.task.infos().items():
            infos[name], infos[f"_{name}"] = values, np.ones(self.num_envs, bool)
        return infos


def _check(render_mode: str | None) -> None:
    if render_mode not in (None, *RENDER_MODES):
        raise CdprError(
            f"render_mode: found {render_mode!r}; accepted: null, {', '.join(RENDER_MODES)}"
        )


def _metadata(common: dict[str, Any], task: RobotTask) -> dict[str, Any]:
    """With as many pictures per second as there are steps."""
    return {**common, "render_fps": round(1.0 / task.options.period)}
