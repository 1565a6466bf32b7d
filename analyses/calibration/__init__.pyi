from .free_motion import FreeMotionTask as FreeMotionTask
from .free_motion import fit_free_motion as fit_free_motion
