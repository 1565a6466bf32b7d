"""Studies of what was published and of what we ask of ourselves, judged by facts that are data.

A study (`study`, with the table of all) is cases: keys, and a call of a function that gives the
other columns of a row; it names functions that draw its rows. `servo` has what runs of a visual
servo share. What sources print is data, `facts/*.yaml`: each fact selects a quantity of some rows
and compares it. `facts` judges them, `report` puts everything into one page.
"""
