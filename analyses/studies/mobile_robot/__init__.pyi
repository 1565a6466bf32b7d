from .figures import FIGURES as FIGURES
from .judges import JUDGES as JUDGES
from .study import study_mobile_robot as study_mobile_robot
