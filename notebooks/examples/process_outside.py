"""A process outside: it closes the loop of a run, here by a client in the same file.

`cdpr serve acrobot_computed_torque --place trajectory` in another shell is the same server.
`pip install 'cdpr_drake[bridge]'` brings what both need.
"""

import subprocess
import sys

from cdpr_drake.systems.remote import RemoteClient

SERVER = [
    sys.executable, "-m", "cdpr_drake", "serve", "acrobot_computed_torque", "--place", "controller",
    "--port", "5791", "--duration", "0.2", "--out", "served",
]  # fmt: skip
WEIGHT = [0.0, 0.0, 0.0, 0.0, 0.0, 34.3]  # moment [N m] and force [N] that carry the platform

with subprocess.Popen(SERVER) as server:
    # The longest wait [s]: the first run compiles before it answers.
    with RemoteClient("tcp://127.0.0.1:5791", timeout=300.0) as client:
        end = client.run(lambda now: {"desired_wrench": WEIGHT})
    print(end)
    server.wait()
