"""What a soak comes back with."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Tally:
    """How many were tried, of what, and what went wrong, a line each."""

    of: str
    tried: int = 0
    failures: list[str] = field(default_factory=list)

    @property
    def survived(self) -> int:
        return self.tried - len(self.failures)
