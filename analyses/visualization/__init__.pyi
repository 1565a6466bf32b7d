from .replay import write_replay as write_replay
