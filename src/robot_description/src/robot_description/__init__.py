"""What a robot is and how it finds its way. See docs/architecture.md."""
