"""Section `adaptation`: exit and anchor points, and lengths, learnt while a visual servo runs."""
