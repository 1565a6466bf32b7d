from .figures import FIGURES as FIGURES
from .judges import CHECKS as CHECKS
from .study import study_mobile_robot as study_mobile_robot
