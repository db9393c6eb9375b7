"""The benchmarks by name, and those that need no ROS."""
