"""What a browser session works on, without the page: robot, pose, scene, commands, runs.

The session: a `Workbench` has the robot as a `Document`: the text of a robot file with undo and
redo, checked by the same validation as `cdpr check`, and never changed by what is not accepted.
`WorkingFolder` is the only place that is read from and written to. `Signal` tells the pages that
show a workbench what has changed. Numbers and the scene belong to one thread, the `Calculator`'s:
who draws says `bench.draw(lambda scene: ...)` and gets a `RobotScene`, whose `meshcat` takes calls
there only. Every result that a panel shows has a `Subject`, the robot and pose that it is about:
`bench.results` knows all of them, and says which are about something else than what is open now.

Jobs: work that the studio's server has, in processes of their own, since Drake and numba hold
Python's lock, and since what kills a run must not kill the server. A job belongs to the server, not
to a page: whoever closes or reloads a page, or opens another, finds it as it is. `CommandJob` is
any `cdpr` subcommand, `RunJob` a `cdpr simulate` that is followed and steered, see
`analyses.runs.steering`. `JobManager` lets a few of them run at a time. Threads of any kind may
call every job and the manager.

Commands: a `CommandForm` says which options a command takes; the command line makes it from its own
functions, so that there is no second list of them. `CommandBoard` starts commands in the working
folder, each as a job. `Regions` are workspaces that were computed, as solids and planes for the
scene.

Runs: `ScenarioDraft` is a scenario with changed fields, checked as `cdpr simulate` does. `RunScene`
draws a run into Meshcat.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
