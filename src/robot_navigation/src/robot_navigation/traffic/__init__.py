"""Who goes first where robots meet, and where a robot moves aside to."""
