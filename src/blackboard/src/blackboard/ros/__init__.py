"""The nodes of this package: parameters, topics and actions around the plain-Python folders.

The only modules of this package that import rospy. Logic belongs in the other folders.
"""
