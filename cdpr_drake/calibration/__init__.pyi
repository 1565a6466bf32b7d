from .program import CalibrationProgram as CalibrationProgram
from .recursive import Learnt as Learnt
from .recursive import RecursiveCalibration as RecursiveCalibration
from .result import CalibrationResult as CalibrationResult
