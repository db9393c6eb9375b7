"""Where a robot is: the particle filter and its models."""
