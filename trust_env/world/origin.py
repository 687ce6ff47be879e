"""Where a detection comes from, as a number: the target's index, clutter, or the injection slot."""

from __future__ import annotations

from trust_env.compiled.kernels import inlined

CLUTTER = -1  # a natural false positive
FIRST_INJECTION = -2  # injection slot m is FIRST_INJECTION - m


@inlined
def is_injection(origin):
    return origin <= FIRST_INJECTION
