"""What a picture and an episode are judged by."""

from trust_env.metrics.episode import RELIABILITY, EpisodeMetrics
from trust_env.metrics.gospa import Gospa, gospa, ospa
from trust_env.metrics.registry import METRICS, Metric

__all__ = ["METRICS", "RELIABILITY", "EpisodeMetrics", "Gospa", "Metric", "gospa", "ospa"]
