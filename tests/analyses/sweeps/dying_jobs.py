"""A job that costs its process; in a module that imports nothing, as processes import it."""

import os


def die_for(job):
    if job < 0:
        os._exit(-job)
    return job
