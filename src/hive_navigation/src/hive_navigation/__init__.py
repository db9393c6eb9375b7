"""How a robot navigates: planning, control, traffic, localization and mapping.

What a robot is belongs in `robot_description`, what tasks it does in `blackboard`.
"""
