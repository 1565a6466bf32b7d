from .free_motion import FreeMotionTask as FreeMotionTask
from .free_motion import fit_free_motion as fit_free_motion
from .identification_task import Identification as Identification
from .identification_task import identify as identify
from .identified_robots import dynamic_model as dynamic_model
from .identified_robots import platform_size as platform_size
