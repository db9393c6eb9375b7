"""What simulated robots sense: laser beams and noise."""
