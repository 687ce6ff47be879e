"""What all tests share: no windows, and tests of optional dependencies that skip by name."""

import importlib.util
import os

import pytest

# Pygame and matplotlib must not look for a screen; set before anything imports them.
os.environ.setdefault("SDL_VIDEODRIVER", "dummy")
os.environ.setdefault("SDL_AUDIODRIVER", "dummy")
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
os.environ.setdefault("MPLBACKEND", "agg")
# The processes of the tests share the cores: PyTorch's threads would wait for one another.
os.environ.setdefault("OMP_NUM_THREADS", "1")

EXTRAS = {
    "train": ("torch", "stable_baselines3", "tensorboard"),
    "plot": ("matplotlib",),
    "render": ("pygame",),
    "bench": ("mpe2", "stonesoup"),
    "browser": ("playwright", "PIL"),
    "docs": ("mkdocs", "mkdocstrings", "nbformat", "nbclient", "ipykernel"),
    "ray": ("ray",),
    "clients": ("ray", "torchrl", "tianshou", "supersuit", "stable_baselines3"),
    "agilerl": ("agilerl",),
    "benchmarl": ("benchmarl",),
}


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test marked `extra(name)` where that extra is missing, unless CI requires it."""
    for mark in item.iter_markers("extra"):
        (name,) = mark.args
        missing = [module for module in EXTRAS[name] if importlib.util.find_spec(module) is None]
        if not missing:
            continue
        reason = f"extra `{name}` is not installed: no module {', '.join(missing)}"
        if name in os.environ.get("TRUST_ENV_REQUIRE_EXTRAS", "").split(","):
            pytest.fail(reason)
        pytest.skip(reason)
