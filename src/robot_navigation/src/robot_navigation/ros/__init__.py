"""The nodes of this package. The only modules of it that import rospy."""
