"""AGVs that speak VDA 5050 and their agents, in processes without ROS, over a real broker."""
