"""Changes to how rospy connects, reads and sends.

Each says which behaviour of rospy it replaces and which measurement asked for it. All of them
reach into the internals of rospy 1.15.15 (Debian 12); check them when rospy changes.
"""
