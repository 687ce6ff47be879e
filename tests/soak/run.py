"""Runs soaks by name, all of them by default, and prints how many of each were tried and survived."""

from __future__ import annotations

import argparse
import time

from soak import extremes, folders, frames

SOAKS = {"extremes": extremes.run, "frames": frames.run, **folders.SOAKS}
"""name: function of the amount, 1 for all of it, that returns a Tally."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(SOAKS)}; kill: all kill-...; all by default")
    parser.add_argument("--amount", type=float, default=1.0, help="the part of each to run, such as 0.01")
    given = parser.parse_args()
    chosen = [[name for name in SOAKS if name == text or name.startswith(f"{text}-")] for text in given.names]
    if unknown := [text for text, names in zip(given.names, chosen) if not names]:
        parser.error(f"no soak is called {', '.join(unknown)}; known: {', '.join(SOAKS)}")
    failed = False
    print(f"{'soak':<14}{'of':<12}{'tried':>12}{'survived':>12}{'seconds':>10}")
    for name in [name for names in chosen for name in names] or SOAKS:
        start = time.monotonic()
        tally = SOAKS[name](given.amount)
        seconds, failed = time.monotonic() - start, failed or bool(tally.failures)
        print(f"{name:<14}{tally.of:<12}{tally.tried:>12,}{tally.survived:>12,}{seconds:>10.0f}", flush=True)
        for failure in tally.failures[:20]:
            print(f"    {failure}")
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())
