"""What stands in the world: walls, stations, doors, people, and the files that describe them."""
