"""The parts of `joint_posterior`: hypotheses, looks, patterns, motions, areas, posterior."""
