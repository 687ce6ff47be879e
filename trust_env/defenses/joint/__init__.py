"""The parts of `joint_posterior`: hypotheses, looks, patterns, velocities, areas, posterior."""
