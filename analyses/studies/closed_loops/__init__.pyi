from .kinematic_servo import kinematic_path as kinematic_path
from .loops import seen_errors as seen_errors
from .servo_models import Perturbation as Perturbation
from .servo_models import perturbed_scenario as perturbed_scenario
from .servo_models import perturbed_servo as perturbed_servo
from .study import STUDIES as STUDIES
from .study import closed_loop_study as closed_loop_study
