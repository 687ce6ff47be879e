"""The program `trust-env`. What its commands call is imported when needed, so that it starts at once."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

import tyro
from tyro.extras import SubcommandApp

import trust_env
from trust_env.errors import unknown_name
from trust_env.training.cli import attacks, defenses, metrics, new, scenarios, threats
from trust_env.training.cli.benchmark import benchmark
from trust_env.training.cli.conform import conform
from trust_env.training.cli.curve import curve
from trust_env.training.cli.demo import demo
from trust_env.training.cli.evaluate import evaluate
from trust_env.training.cli.exploit import exploit
from trust_env.training.cli.options import INTERRUPTED, OK, WRONG_INPUT, Command, Group
from trust_env.training.cli.rank import rank
from trust_env.training.cli.replay import replay
from trust_env.training.cli.report import report
from trust_env.training.cli.reproduce import reproduce
from trust_env.training.cli.streams import open_streams
from trust_env.training.cli.train import train

DEBUG = "TRUST_ENV_DEBUG"  # set it to see where an error comes from

COMMANDS: dict[str, Command | Group] = {
    "demo": demo,
    "evaluate": evaluate,
    "curve": curve,
    "report": report,
    "replay": replay,
    "reproduce": reproduce,
    "conform": conform,
    "benchmark": benchmark,
    "train": train,
    "exploit": exploit,
    "rank": rank,
    "new": new.COMMANDS,
    "scenarios": scenarios.COMMANDS,
    "defenses": defenses.COMMANDS,
    "attacks": attacks.COMMANDS,
    "threats": threats.COMMANDS,
    "metrics": metrics.COMMANDS,
}


def build_app() -> SubcommandApp:
    """The parser of the command line, with every command of `COMMANDS`."""
    app = SubcommandApp()
    for name, command in COMMANDS.items():
        if isinstance(command, Group):
            app.command(_build_group(command), name=name, help=command.help)
        else:
            app.command(name=name)(command)
    return app


def _build_group(group: Group) -> SubcommandApp:
    app = SubcommandApp()
    for name, command in group.commands.items():
        app.command(name=name)(command)
    return app


def main(args: Sequence[str] | None = None) -> int:
    """Run one command. 0: done; 1: a check failed; 2: wrong input; 130: interrupted.

    args: by default those of the process, which then also gets streams that cannot fail.
    """
    if args is None:
        open_streams()
        args = sys.argv[1:]
    if list(args) == ["--version"]:
        print(f"trust-env {trust_env.__version__}")
        return OK
    try:
        check_command(args)
        code = build_app().cli(
            prog="trust-env",
            description="Attacks and trust defenses in multi-agent sensor fusion. --version prints the version.",
            args=args,
            config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes, tyro.conf.DisallowNone),
        )
        sys.stdout.flush()
        return code or OK
    except KeyboardInterrupt:
        print("trust-env: interrupted", file=sys.stderr)
        return INTERRUPTED
    except (ValueError, OSError, ImportError) as error:
        if os.environ.get(DEBUG):
            raise
        print(f"trust-env: error: {format_error(error)}", file=sys.stderr)
        return WRONG_INPUT


def check_command(args: Sequence[str]) -> None:
    """ValueError, with the nearest name, for the first word that should be a command and is not."""
    words = [word for word in args[:2] if not word.startswith("-")]
    command = COMMANDS.get(words[0]) if words else None
    if words and command is None:
        raise unknown_name("command", words[0], COMMANDS)
    if isinstance(command, Group) and words[1:] and words[1] not in command.commands:
        raise unknown_name(f"command of {words[0]}", words[1], command.commands)


def format_error(error: Exception) -> str:
    """An error as one message; one of the operating system's begins with the file."""
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror or error}"
    return str(error)
