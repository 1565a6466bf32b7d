"""Results of the whole project, kept in a folder outside of it and compared after a change.

    python -m tests.golden make FOLDER      # with the code before the change
    python -m tests.golden compare FOLDER   # with the code after it; exit code 1 on a difference

Everything goes through the command `cdpr`, so that modules may move and change their names.
"""
