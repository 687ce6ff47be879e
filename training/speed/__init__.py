"""What `benchmark` times: our own subjects, their peers, and how."""
