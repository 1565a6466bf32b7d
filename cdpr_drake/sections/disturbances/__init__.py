"""Section `disturbances`: pushes, sines, wind and loads on the platform."""
