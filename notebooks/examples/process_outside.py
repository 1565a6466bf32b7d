"""A process outside: it closes the loop of a run for 2 s, here by a client in the same file.

`cdpr serve acrobot_computed_torque --place controller` in another shell is the same server.
`pip install 'cdpr_drake[bridge]'` brings what both need.
"""

import subprocess
import sys

import numpy as np

from cdpr_drake.sections.remote import RemoteClient

SERVER = [
    sys.executable, "-m", "cdpr_drake", "serve", "acrobot_computed_torque", "--place", "controller",
    "--port", "5791", "--duration", "2", "--out", "served",
]  # fmt: skip
MASS, GYRATION = 3.5, 0.003  # [kg], mean moment of inertia over mass [m^2]


def law(now):
    """Moment and force of a PD law about the desired motion, for a platform that hardly turns."""
    goal, state = (np.asarray(now.outputs[name]) for name in ("desired_motion", "platform_state"))
    way = np.hstack([2.0 * (goal[1:4] - state[1:4]), goal[4:7] - state[4:7]])
    wanted = goal[13:19] + 100.0 * way + 20.0 * (goal[7:13] - state[7:13])
    wanted[5] += 9.81
    return {"desired_wrench": MASS * np.hstack([GYRATION * wanted[:3], wanted[3:]])}


with subprocess.Popen(SERVER) as server:
    # The longest wait [s]: the first run compiles before it answers.
    with RemoteClient("tcp://127.0.0.1:5791", timeout=300.0) as client:
        end = client.run(law)
    print(end)
    server.wait()
