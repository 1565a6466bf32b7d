"""Cases IX and X of the servoing thesis, cables that are slack at the start, and what follows:
winches by torque, and tension management beside trajectory tracking."""
