"""Messages to core values and back: tables of fields, and the engine that follows them.

Nothing here subscribes, publishes or decides.
"""
