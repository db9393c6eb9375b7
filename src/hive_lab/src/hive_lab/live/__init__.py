"""Real hives on real ROS, and the benchmarks that need one."""
