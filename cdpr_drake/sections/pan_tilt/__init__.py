"""Section `camera.pan_tilt`: two joints that turn a servo's camera and keep its target in view."""
