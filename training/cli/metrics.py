"""Command line: metrics list, show."""

from __future__ import annotations

from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.training.cli.options import Group, Json, print_json


def list_metrics(as_json: Json = False) -> None:
    """What an evaluation measures, each metric in a line."""
    from trust_env.metrics import METRICS
    from trust_env.training.cli.catalogue import print_names

    print_names({name: metric.definition for name, metric in METRICS.items()}, as_json)


def show_metric(name: Annotated[Positional[str], arg(help="a metric")], as_json: Json = False) -> None:
    """A metric's definition and unit, which way is worse, and when it is absent."""
    from trust_env.errors import unknown_name
    from trust_env.metrics import METRICS

    if name not in METRICS:
        raise unknown_name("metric", name, METRICS)
    metric = METRICS[name]
    if as_json:
        print_json(metric._asdict())
        return
    print(f"{name}\n\n{metric.definition}\n")
    print(f"unit: {metric.unit}\nworse: {metric.worse}\nabsent: {metric.absent or 'at no time'}")
    if metric.never_where:
        print(f"absent where {metric.never_where} is not: never")


COMMANDS = Group("What an evaluation measures: list, show.", {"list": list_metrics, "show": show_metric})
