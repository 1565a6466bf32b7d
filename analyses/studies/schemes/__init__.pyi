from .study import STUDY as STUDY
from .trials import FreeCamera as FreeCamera
from .trials import turned as turned
