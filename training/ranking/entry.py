"""Entries of other people: a folder with their code and `entry.yaml`, which says what of it joins the ranking."""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from trust_env.files import expanded
from trust_env.scenario.types import Part
from trust_env.scenario.yaml_lines import read_yaml
from trust_env.spec import Spec, parse

FILE = "entry.yaml"


class Entry(Part):
    """The fields of entry.yaml. defenses, attacks: `file.py:Class(parameter=value)`, the file beside entry.yaml."""

    authors: str = Field(min_length=1)
    about: str = Field(min_length=1)
    defenses: tuple[str, ...] = ()
    attacks: tuple[str, ...] = ()


def load_entry(folder: str | Path) -> Entry:
    """The entry in a folder, its files named from where the program runs. ValueError: there is none, or it is wrong."""
    file = expanded(folder) / FILE
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as fault:
        raise ValueError(f"{file}: expected the YAML file of an entry: {fault}") from None
    entry = Entry.model_validate(read_yaml(text, str(file))[0])
    if not (entry.defenses or entry.attacks):
        raise ValueError(f"{file}: expected at least one of `defenses` and `attacks`")
    defenses, attacks = (tuple(_from(file.parent, text) for text in texts) for texts in (entry.defenses, entry.attacks))
    return entry.model_copy(update={"defenses": defenses, "attacks": attacks})


def _from(folder: Path, text: str) -> str:
    """A spec whose file lies in a folder."""
    spec = parse(text)
    if spec.path is None:
        raise ValueError(f"{folder / FILE}: {text}: expected a file beside it, as in defense.py:MyDefense")
    return str(Spec(spec.name, spec.params, str(folder / spec.path)))
