"""Gymnasium: a law that goes straight to the goal, on 32 robots at once that all differ.

Replace `policy` by one that learns. `pip install 'cdpr_drake[gym]'` brings Gymnasium. Once
`cdpr_drake.gym` is imported, gymnasium.make_vec("cdpr/Reach-v0", COUNT, ...) makes the same.
"""

import numpy as np

import cdpr_drake as cdpr
from cdpr_drake.gym import STEPS

COUNT = 32
DOUBT = {"*.exit_point.*": 0.002, "mass": 0.2}  # standard deviations [m, kg]


def policy(observation):
    """Twists, over full speed, from where the goals are: numbers 20 to 22 of eight cables."""
    action = np.zeros((len(observation), 6), np.float32)
    action[:, 3:] = 3.0 * observation[:, 20:23]  # cut at -1 and 1 by the environment
    return action


envs = cdpr.make_environment("Reach", COUNT, action="twist", randomise=DOUBT)
observation, _ = envs.reset(seed=0)
total = np.zeros(COUNT)
for _ in range(STEPS["Reach"]):
    observation, reward, lost, late, info = envs.step(policy(observation))
    total += reward
print(f"return {total.mean():.1f} +- {total.std():.1f}")
print(f"{info['success'].sum()} of {COUNT} at their goals, {lost.sum()} lost")
