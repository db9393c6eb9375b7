"""The files that users write: fleets, scenarios, places."""
