"""The nodes of this package, and the only modules of it that import rospy.

What a node decides belongs in the other folders; these translate messages and parameters.
"""
