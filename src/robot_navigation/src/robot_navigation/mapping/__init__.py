"""Makes a map from scans and odometry, and drives a robot to what is still unknown."""
