"""Section `emergency`: what a robot does when a cable has broken, and how that is found."""
