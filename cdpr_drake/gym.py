"""Registers the learning environments with Gymnasium: `import cdpr_drake.gym`.

    import gymnasium
    import cdpr_drake.gym

    env = gymnasium.make("cdpr/Reach-v0", robot="caroca")
    envs = gymnasium.make_vec("cdpr/Reach-v0", num_envs=256)

Names are `cdpr/Reach-v0`, `cdpr/Track-v0`, `cdpr/VisualServo-v0` and `cdpr/PickAndPlace-v0`; what
they are is said in `cdpr_drake.analyses.learning`, which is imported when one is made.
"""

from __future__ import annotations

from cdpr_drake.errors import CdprError, install_words

try:
    from gymnasium.envs.registration import register
except ImportError as problem:
    raise CdprError(
        f"cdpr_drake.gym: the package gymnasium is not installed; {install_words('gym')}"
    ) from problem

STEPS = {"Reach": 250, "Track": 250, "VisualServo": 250, "PickAndPlace": 500}
"""The tasks by name, and steps of an episode."""

_ROOM = "cdpr_drake.analyses.learning.environments"

for _name, _steps in STEPS.items():
    register(
        f"cdpr/{_name}-v0",
        entry_point=f"{_ROOM}:RobotEnv",
        vector_entry_point=f"{_ROOM}:RobotVectorEnv",
        max_episode_steps=_steps,
        kwargs={"task": _name},
    )
