"""What an operator of a hive runs. See docs/architecture.md."""
