from .cameras import pinholes as pinholes
from .gripper import Gripper as Gripper
from .handling_machine import HandlingMachine as HandlingMachine
from .handling_task import HandlingTask as HandlingTask
from .workpiece import stem as stem
