"""What a task costs a robot: cost models, energy, time, path lengths, schedules and bids.

Pure computation. Who is asked for bids and who wins belongs in `auction`.
"""
