from .batch_robots import BatchRobots as BatchRobots
from .batch_robots import BatchRollout as BatchRollout
from .batch_robots import BatchState as BatchState
