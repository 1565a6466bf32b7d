from .camera_miscalibration import Calibration as Calibration
from .camera_miscalibration import answers as answers
from .camera_miscalibration import calibration_verdicts as calibration_verdicts
from .camera_miscalibration import mixture as mixture
from .sensor_filter import correct as correct
from .sensor_filter import move as move
from .sensor_models import Look as Look
