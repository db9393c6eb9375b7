"""The world that robots sense and bump into. See docs/architecture.md."""
