from .batch_robots import BatchRobots as BatchRobots
