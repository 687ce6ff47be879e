"""The command line as a fixture."""

import pytest

from trust_env.training.cli.main import main


@pytest.fixture
def cli(capsys):
    """Run a command: its exit code, and what it wrote to stdout and stderr."""

    def run(*arguments):
        capsys.readouterr()
        try:
            code = main([str(a) for a in arguments])
        except SystemExit as stop:  # the parser's own
            code = stop.code
        written = capsys.readouterr()
        return code, written.out, written.err

    return run
