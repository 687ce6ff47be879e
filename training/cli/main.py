"""The program `trust-env`. What its commands call is imported when needed, so that it starts at once."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

import tyro
from tyro.extras import SubcommandApp

from trust_env.training.cli import evaluate as commands
from trust_env.training.cli import listing as catalogue_commands

OK, CHECK_FAILED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130
DEBUG = "TRUST_ENV_DEBUG"  # set it to see where an error comes from


def build_app() -> SubcommandApp:
    """Every command by name; each is a function that returns an exit code, or None when all is well."""
    app = SubcommandApp()
    for name, command in commands.COMMANDS.items():
        app.command(name=name)(command)
    for group, (text, members) in catalogue_commands.GROUPS.items():
        nested = SubcommandApp()
        for name, command in members.items():
            nested.command(name=name)(command)
        app.command(nested, name=group, help=text)
    return app


def main(args: Sequence[str] | None = None) -> int:
    """Run one command. 0: done; 1: a check failed; 2: wrong input; 130: interrupted."""
    try:
        code = build_app().cli(
            prog="trust-env",
            description="Attacks and trust defenses in multi-agent sensor fusion.",
            args=args,
            config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes, tyro.conf.DisallowNone),
        )
        sys.stdout.flush()
        return code or OK
    except KeyboardInterrupt:
        print("trust-env: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read the output has left, as in `trust-env ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK
    except (ValueError, OSError, ImportError) as error:
        if os.environ.get(DEBUG):
            raise
        print(f"trust-env: error: {told(error)}", file=sys.stderr)
        return WRONG_INPUT


def told(error: Exception) -> str:
    """An error as one message: of the operating system's, the file and what is the matter with it."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror or error}"
    return str(error)
