"""Drives `cdpr serve acrobot_computed_torque --place controller`; needs pyzmq, and no cdpr_drake.

PD about the desired motion, with weight and desired acceleration of a platform of 3.5 kg fed
forward. The messages: python -c "import cdpr_drake.sections.remote as b; print(b.__doc__)"
"""

import json
import sys

import zmq

MASS, GRAVITY, KP, KD = 3.5, 9.81, 100.0, 20.0
INERTIA = (0.0099, 0.0109, 0.0179)  # of a box of 0.18 x 0.17 x 0.07 m about its middle [kg m^2]
HEIGHT = 0.005  # of the centre of mass above Po, along z of P [m]


def wrench(goal: list[float], state: list[float]) -> list[float]:
    """Moment about Po and force, from the desired motion and that of the platform."""
    (a, b, c, d), (w, x, y, z) = goal[:4], state[:4]
    sign = 2.0 if a * w + b * x + c * y + d * z >= 0.0 else -2.0
    turn = (b * w - a * x - c * z + d * y, c * w - a * y + b * z - d * x,
            d * w - a * z - b * y + c * x)  # fmt: skip
    way = [sign * turn[0], sign * turn[1], sign * turn[2]]
    way += [goal[k] - state[k] for k in (4, 5, 6)]
    rate = [goal[k] - state[k] for k in range(7, 13)]
    wanted = [goal[13 + k] + KP * way[k] + KD * rate[k] for k in range(6)]
    fx, fy, fz = MASS * wanted[3], MASS * wanted[4], MASS * (wanted[5] + GRAVITY)
    # The mass lies off Po, on an axis that tilts with the platform.
    rx, ry = 2.0 * HEIGHT * (x * z + w * y), 2.0 * HEIGHT * (y * z - w * x)
    rz = HEIGHT * (1.0 - 2.0 * (x * x + y * y))
    mx, my, mz = (INERTIA[k] * wanted[k] for k in range(3))
    return [mx + ry * fz - rz * fy, my + rz * fx - rx * fz, mz + rx * fy - ry * fx, fx, fy, fz]


socket = zmq.Context().socket(zmq.REQ)
socket.connect(sys.argv[1] if len(sys.argv) > 1 else "tcp://127.0.0.1:5757")
message = {"do": "start", "outputs": ["desired_motion", "platform_state"]}
while message:
    socket.send(json.dumps(message).encode())
    now = json.loads(socket.recv())
    seen = now.get("outputs")
    message = seen and {"do": "step", "inputs": {"desired_wrench": wrench(*seen.values())}}
print(now)
