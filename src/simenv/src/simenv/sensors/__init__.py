"""What simulated robots sense: laser beams."""
