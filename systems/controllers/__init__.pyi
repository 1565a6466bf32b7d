from .feature_servo import FeatureServo as FeatureServo
from .schemes import SCHEMES as SCHEMES
from .servo_settings import ControllerSettings as ControllerSettings
from .tension_corrector import TensionCorrector as TensionCorrector
from .tension_distributor import TensionDistributor as TensionDistributor
from .tension_management_settings import TensionManagement as TensionManagement
from .torque_controller import TorqueController as TorqueController
