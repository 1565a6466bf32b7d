from .camera_miscalibration import Calibration as Calibration
from .camera_miscalibration import answers as answers
from .camera_miscalibration import judged as judged
from .camera_miscalibration import mixed as mixed
from .sensor_filter import correct as correct
from .sensor_filter import move as move
from .sensor_models import Look as Look
