from .kinematic_servo import kinematic_path as kinematic_path
from .loops import seen_errors as seen_errors
from .servo_models import Perturbation as Perturbation
from .servo_models import perturbed_scenario as perturbed_scenario
from .servo_models import perturbed_servo as perturbed_servo
from .study import CHECKS as CHECKS
from .study import study_closed_loop as study_closed_loop
