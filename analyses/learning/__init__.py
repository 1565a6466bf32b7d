"""Tasks for reinforcement learning, on one robot or on many at once, as Gymnasium environments.

A `RobotTask` begins episodes, takes actions, and gives observations and rewards, of many robots in
arrays; it knows no Gymnasium. What moves the robots is `systems.batches.BatchRobots`. `RobotEnv` is
a task with one robot, `RobotVectorEnv` with many: both run the same code, row by row, so that many
robots do what each does alone, to the last bit. `import cdpr_drake.gym` registers them.

Actions are numbers from -1 to 1. Observations are numbers near 1, each a quantity over a scale that
`RobotTask.scales` tells, cut at `MOST`. Quantities are in W unless they say otherwise.

Source: Towers et al., Gymnasium, 2024, for the interface; Tobin et al., Domain randomization, 2017.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
