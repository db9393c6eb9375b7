"""The thin shell around the cores: nodes, topics, threads."""
