"""The nodes of this package, and what connects the plain-Python folders to ROS.

Only modules here import rospy. Decisions belong in the other folders.
"""
