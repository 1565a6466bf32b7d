"""Studies of what was published and of what we ask of ourselves, judged by facts that are data.

`study` is their frame and table, `servo` what runs of a visual servo share, `facts` and
`facts/*.yaml` what sources print, `report` the page of all.
"""
