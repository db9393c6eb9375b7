"""How a program outside the hive posts tasks and follows them, and shows them as text."""
