"""The ranking: how much damage every defense lets through, under a protocol that has a version."""
