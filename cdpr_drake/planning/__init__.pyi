from .free_path import FreePathProgram as FreePathProgram
from .input_shaping import make_shaper as make_shaper
from .path_task import sample_motion as sample_motion
from .path_timing import plan_along_path as plan_along_path
from .path_timing_program import PathTimingProgram as PathTimingProgram
