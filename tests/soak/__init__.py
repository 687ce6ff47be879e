"""What is too long for every run of the tests: `make soak`, or `python -m soak.run` in tests/. One file each."""
