from .kinematic_servo import kinematic_path as kinematic_path
from .loops import seen_errors as seen_errors
from .study import STUDIES as STUDIES
from .study import closed_loop_study as closed_loop_study
