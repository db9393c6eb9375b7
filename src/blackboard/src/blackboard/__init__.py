"""Tasks, bids, and the hive that decides who does what. See docs/architecture.md."""
