from .environments import RobotEnv as RobotEnv
from .environments import RobotVectorEnv as RobotVectorEnv
from .robot_task import RobotTask as RobotTask
from .task_table import TASKS as TASKS
from .task_table import make_task as make_task
