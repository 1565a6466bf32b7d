"""What watches a run without taking part: its end, tensions, stability, log, pictures, state."""
