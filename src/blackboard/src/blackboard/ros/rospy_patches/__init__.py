"""Changes to how rospy connects, reads and sends, each with the measurement that asks for it."""
