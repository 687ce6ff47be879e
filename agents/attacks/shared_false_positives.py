"""False positives where all adversaries see them: the exact frame of Theorem 1."""

from __future__ import annotations

from trust_env.agents.attacks.placed_phantoms import PlacedPhantoms


class OptimalFalsePositive(PlacedPhantoms):
    """Static false positives where the FOVs of all adversaries intersect, which all report in every frame.

    Every one lies on the tracker's predicted position, d² = 0, which gains the most (Hallyburton & Pajic
    2024, Prop. 1): alone it is confirmed in the frame of `trust_env.theory.score_optimal_frames`. Where no
    point lies in all FOVs, a phantom is put where as many adversaries as possible can report it.
    """

    name = "optimal_false_positive"
    reported_by_all = True

    def __init__(
        self,
        n: int | None = None,
        start: int = 0,
        hit_rate: float | None = 1.0,
        share: bool = True,
        motion: str = "static",
        speed: float | None = None,
        noise: float | None = 0.0,
        suppress: float = 0.0,
    ):
        super().__init__(n, share, motion, speed, noise, hit_rate, start, suppress)
