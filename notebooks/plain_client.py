"""Drives `cdpr serve acrobot_computed_torque --place controller`; needs pyzmq only.

A PD law about the desired motion, with the weight and the desired acceleration fed forward: the
platform of 3.5 kg follows within a few millimetres. Messages: python -c "help('cdpr_drake.bridge')"
"""

import json
import sys

import zmq

MASS, GRAVITY = 3.5, 9.81
INERTIA = [0.0099, 0.0109, 0.0179]  # of its box of 0.18 x 0.17 x 0.07 m, about the middle
HEIGHT = 0.035  # of the middle above Po
KP, KD = 100.0, 20.0


def wrench(motion, state):
    """Moment and force about Po, from desired and true motion."""
    w, x, y, z = state[:4]
    a, b, c, d = motion[:4]
    turn = [b * w - a * x - c * z + d * y, c * w - a * y + b * z - d * x,
            d * w - a * z - b * y + c * x]  # fmt: skip
    sign = 2.0 if a * w + b * x + c * y + d * z >= 0.0 else -2.0
    spin = [motion[13 + k] + KP * sign * turn[k] + KD * (motion[7 + k] - state[7 + k])
            for k in range(3)]  # fmt: skip
    force = [MASS * (motion[16 + k] + KP * (motion[4 + k] - state[4 + k])
                     + KD * (motion[10 + k] - state[10 + k])) for k in range(3)]  # fmt: skip
    force[2] += MASS * GRAVITY
    moment = [INERTIA[k] * spin[k] for k in range(3)]
    return [moment[0] - HEIGHT * force[1], moment[1] + HEIGHT * force[0], moment[2], *force]


socket = zmq.Context().socket(zmq.REQ)
socket.connect(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:5757")
message = {"do": "start", "outputs": ["platform_state", "desired_motion"]}
while True:
    socket.send(json.dumps(message).encode())
    now = json.loads(socket.recv())
    if "outputs" not in now:
        break
    seen = now["outputs"]
    command = wrench(seen["desired_motion"], seen["platform_state"])
    message = {"do": "step", "inputs": {"desired_wrench": command}}
print(now)
