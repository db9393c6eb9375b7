"""Making a map from scans and odometry, and driving a robot to what is still unknown.

Finding a robot on a finished map belongs in `localization`.
"""
