"""`python -m trust_env.training.cli`: the program `trust-env` where it is not on the path."""

import sys

from trust_env.training.cli.main import main

sys.exit(main())
