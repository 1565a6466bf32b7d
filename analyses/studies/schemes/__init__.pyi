from .statements import CHECKS as CHECKS
from .study import study_schemes as study_schemes
from .trials import FreeCamera as FreeCamera
from .trials import turned as turned
