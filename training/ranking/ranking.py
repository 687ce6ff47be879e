"""Rows with what they rest on: as JSON, as tables, and compared with another ranking."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np

import trust_env
from trust_env.files import write_atomically
from trust_env.parallel import TrustEnv
from trust_env.training.ranking.table import table_of

CLAIMS = {
    "quick": "transfer: the attacks are a fixed list, some of them tuned against one defense only, that of the "
    "protocol's `search`, so that the order claims nothing about attacks tuned against the others",
    "full": "adaptive: attacks were searched and trained against each defense under a fixed budget; every figure is a "
    "lower bound on the worst case",
}


class Ranking:
    """A ranking as plain values: `fields` are those of its JSON file."""

    def __init__(self, fields: Mapping[str, Any]):
        self.fields = dict(fields)

    @property
    def rows(self) -> list[dict[str, Any]]:
        return self.fields["rows"]

    def to_dict(self) -> dict[str, Any]:
        """Plain values only, ready for JSON."""
        return self.fields

    def groups(self) -> Iterator[tuple[str, str, list[dict[str, Any]]]]:
        """Scenario, threat model and rows, from the least damage by the worst attack to the most, references last."""
        for scenario, threat in dict.fromkeys((row["scenario"], row["threat"]) for row in self.rows):
            found = [row for row in self.rows if (row["scenario"], row["threat"]) == (scenario, threat)]
            yield scenario, threat, sorted(found, key=_rank)

    def markdown(self) -> str:
        """The tables, and what they say."""
        return table_of(self.fields, list(self.groups()))

    def print(self, console: Any) -> None:
        """Print the tables."""
        console.print(self.markdown(), markup=False, soft_wrap=True, highlight=False)

    def save(self, folder: Path) -> None:
        """Write quick.json and quick.md, or full.json and full.md, into a folder that is there."""
        kind = self.fields["kind"]
        text = json.dumps(self.fields, indent=1, allow_nan=False) + "\n"
        for name, content in ((f"{kind}.json", text), (f"{kind}.md", self.markdown())):
            write_atomically(folder / name, lambda file, content=content: file.write_text(content, encoding="utf-8"))


def _rank(row: Mapping[str, Any]) -> tuple[bool, float]:
    return row["reference"], row["worst"]["mean"]["value"]


def header(kind: str, protocol: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a ranking but its rows: the claim, the protocol, and what the bits depend on."""
    return {
        "kind": kind,
        "version": protocol["version"],
        "claim": CLAIMS[kind],
        **made_with(),
        "protocol": dict(protocol),
    }


def made_with() -> dict[str, str]:
    """What the bits of results depend on, beside the protocol."""
    return {
        "environment": TrustEnv.metadata["name"],
        "package": trust_env.__version__,
        "numpy": np.__version__,
        "processor": f"{platform.machine()} {llvm.get_host_cpu_name()}",
    }


def load_ranking(file: Path) -> Ranking:
    """The ranking of a JSON file. ValueError: it holds none."""
    try:
        fields = json.loads(file.read_text(encoding="utf-8"))
        found = Ranking(fields)
        if fields["kind"] not in CLAIMS or not all("worst" in row for row in found.rows):
            raise KeyError("kind")
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise ValueError(f"{file}: expected the JSON of a ranking: {fault}") from None
    return found
