"""Robots as bodies: bases, wheels, contacts and arms."""
