"""How long it takes to the first frame: importing, compiling, loading the cache; each in a fresh process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from trust_env.training.speed.stopwatch import Spread

HEAVY = ("torch", "pygame", "matplotlib", "numba")
"""Modules that `import trust_env` must not bring in."""

_IMPORT = """
import json, sys, time
start = time.perf_counter()
import trust_env
print(json.dumps({"seconds": time.perf_counter() - start, "modules": [m for m in %r if m in sys.modules]}))
"""
_FIRST_FRAME = """
import json, time
start = time.perf_counter()
import trust_env
env = trust_env.parallel_env("case1")
env.reset(seed=0)
env.step({agent: env.action_space(agent).sample() for agent in env.agents})
print(json.dumps({"seconds": time.perf_counter() - start}))
"""


def import_time(repetitions: int) -> dict[str, Any]:
    """Seconds of `import trust_env`, and which of the heavy modules it brings in."""
    found = [_run_python(_IMPORT % (HEAVY,)) for _ in range(repetitions)]
    brought = sorted({module for each in found for module in each["modules"]})
    return {"seconds": Spread.of([each["seconds"] for each in found]).to_dict(), "brings_in": brought}


def first_frame() -> dict[str, float]:
    """Seconds to the first frame with an empty cache of compiled code, and with the one that this leaves."""
    with tempfile.TemporaryDirectory(prefix="trust-env-cache-") as folder:
        compiled = _run_python(_FIRST_FRAME, {"NUMBA_CACHE_DIR": folder})
        cached = _run_python(_FIRST_FRAME, {"NUMBA_CACHE_DIR": folder})
    return {"compiling_seconds": compiled["seconds"], "from_cache_seconds": cached["seconds"]}


def _run_python(code: str, environment: Mapping[str, str] | None = None) -> dict[str, Any]:
    """The last line that a fresh interpreter prints when it runs the code, read as JSON."""
    import trust_env

    paths = [str(Path(trust_env.__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    known = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **known, **(environment or {})},
        capture_output=True,
        text=True,
    )
    if done.returncode:
        raise RuntimeError(f"a fresh Python could not run trust_env:\n{done.stderr.strip()}")
    return json.loads(done.stdout.splitlines()[-1])
