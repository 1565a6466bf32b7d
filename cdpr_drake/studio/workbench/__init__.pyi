from .document import Document as Document
from .result_subject import Results as Results
from .result_subject import Subject as Subject
from .robot_files import exported as exported
from .scenario_draft import ROBOT as ROBOT
from .yaml_edit import has as has
