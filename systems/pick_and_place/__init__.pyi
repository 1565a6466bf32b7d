from .cameras import pinholes as pinholes
from .gripper import Gripper as Gripper
from .pick_and_place_state_machine import PickAndPlaceStateMachine as PickAndPlaceStateMachine
from .pick_and_place_task import PickAndPlaceTask as PickAndPlaceTask
from .workpiece import stem as stem
