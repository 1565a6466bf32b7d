"""What a browser session works on, without the page: robot, pose, scene, commands' forms, runs.

A `Workbench` has the robot as a `Document`: the text of a robot file with undo and redo, checked by
the same validation as `cdpr check`, and never changed by what is not accepted. `WorkingFolder` is
the only place that is read from and written to. `Signal` tells the pages that show a workbench what
has changed. Numbers and the scene belong to one thread, the `Calculator`'s: who draws says
`bench.draw(lambda scene: ...)` and gets a `RobotScene`, whose `meshcat` takes calls there only.

A `CommandForm` says which options a command takes; the command line makes it from its own
functions, so that there is no second list of them. `Regions` are workspaces that were computed, as
solids and planes for the scene. `ScenarioDraft` is a scenario with changed fields, checked as
`cdpr simulate` does; `RunScene` draws a run into Meshcat.
"""
