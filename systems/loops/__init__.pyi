from .loop_choice import why_diagram as why_diagram
from .remote_tension_loop import RemoteTensionLoop as RemoteTensionLoop
from .servo_loop import ServoLoop as ServoLoop
