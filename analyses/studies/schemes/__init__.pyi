from .statements import JUDGES as JUDGES
from .study import study_schemes as study_schemes
from .trials import FreeCamera as FreeCamera
from .trials import turned as turned
