"""How a robot finds its way: planning, control, traffic, localization and mapping.

What a robot is belongs in `robot_description`; what it is asked to do in `blackboard`.
"""
