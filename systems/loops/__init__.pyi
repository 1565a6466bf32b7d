from .loop_choice import diagram_reason as diagram_reason
from .servo_loop import ServoLoop as ServoLoop
