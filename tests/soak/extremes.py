"""Scenarios at the ends of what their schema accepts, under random actions and defenses."""

from __future__ import annotations

import faulthandler

import numpy as np
from extreme_scenarios import draw_scenario
from extreme_worlds import play

from soak.tally import Tally

HANG = 300  # s, after which a kernel is taken to have no end


def run(amount: float) -> Tally:
    """20,000 scenarios, or that part of them."""
    tally = Tally("scenarios")
    for seed in range(10**6, 10**6 + max(1, round(20_000 * amount))):
        rng = np.random.default_rng(seed)
        tally.tried += 1
        faulthandler.dump_traceback_later(HANG, exit=True)
        try:
            # Some large ones among them, up to a tenth of what a world may take.
            large = seed % 100 == 0
            scenario = draw_scenario(rng, *((2e8, 1e8) if large else (2e6, 1e6)))
            play(scenario, rng, frames=4 if large else 10)
        except Exception as fault:
            tally.failures.append(f"seed {seed}: {type(fault).__name__}: {fault}")
        finally:
            faulthandler.cancel_dump_traceback_later()
    return tally
