from .loop_choice import diagram_reason as diagram_reason
from .remote_tension_loop import RemoteTensionLoop as RemoteTensionLoop
from .servo_loop import ServoLoop as ServoLoop
