"""What a picture and an episode are judged by."""

from trust_env.metrics.episode import METRICS, EpisodeMetrics
from trust_env.metrics.gospa import Gospa, gospa, ospa

__all__ = ["METRICS", "EpisodeMetrics", "Gospa", "gospa", "ospa"]
