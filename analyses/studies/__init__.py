"""Studies that repeat what was published, one room each; they do not know each other.

`cdpr_drake.analyses.studies.catalogue` is their table.
"""
