"""The pages of the documentation that are made from the code, as Markdown by path. Nothing in them is written twice."""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent


def scenario_pages() -> str:
    """The built-in scenarios, then every field with its unit, default and values."""
    from trust_env.scenario import scenario_fields, scenarios
    from trust_env.scenario.json_schema import field_infos

    known = [(f"`{name}`", scenario_fields(name)["description"]) for name in scenarios()]
    text = [
        "# Scenarios and their fields\n",
        "`trust-env scenarios list`, `show NAME`, `explain FIELD`, `schema` and `check FILE` print what stands here. "
        "[How to write one](../how-to/scenario.md).\n",
        table(("scenario", "what it is"), known),
        "## Fields\n",
    ]
    sections: dict[str, list[tuple[str, ...]]] = {}
    comments: dict[str, str] = {"": ""}
    for info in field_infos().values():
        section = re.split(r"\[\]|\.", info.name)[0]
        nested = info.values.startswith("mapping")
        if info.name == section and (nested or "mapping" in info.values):
            comments[section] = info.comment
            continue
        row = (f"`{info.name}`", info.unit, _default(info.default), escape(info.values), escape(info.comment))
        sections.setdefault(section if section in comments else "", []).append(row)
    for section, rows in sections.items():
        if section:
            text.append(f"### `{section}`\n\n{escape(comments[section])}\n")
        text.append(table(("field", "unit", "default", "values", "what it is"), rows))
    return "\n".join(text)


def attack_page() -> str:
    """Every built-in attack: what it does, what it must know, its parameters."""
    from trust_env.agents import POLICIES

    head = (
        "# Attacks\n\nAn attack is a policy of the adversaries; `honest` is the control. Each is played by its name: "
        "`--attack false_positive(n=2)`. *Knowledge* is the least that an attack has to observe; an evaluation raises "
        "the scenario's level to it and says so. [How to write one](../how-to/attack.md).\n"
    )
    return head + _entries("attack", POLICIES)


def defense_page() -> str:
    """Every built-in defense: what it estimates, its parameters and presets."""
    from trust_env.defenses import DEFENSES

    head = (
        "# Defenses\n\nA defense turns the evidence of a frame into a verdict; what a verdict does is chosen apart, as "
        "the scenario's `actuation`. Each is named as in `--defense trust(preset=cdc2024)`. "
        "[How to write one](../how-to/defense.md).\n"
    )
    return head + _entries("defense", DEFENSES)


def _entries(kind: str, registry: Mapping[str, type]) -> str:
    from trust_env.training.cli.catalogue import describe_entry, descriptions

    rows = [(f"[`{name}`](#{name})", escape(text)) for name, text in descriptions(registry).items()]
    parts = [table((kind, "in a line"), rows)]
    for name in registry:
        entry = describe_entry(kind, name, registry)
        text, said = _split_parameters(entry["doc"])
        parts.append(f"## {name} {{ #{name} }}\n\n{text}\n")
        if "knowledge" in entry:
            parts.append(f"Knowledge: `{entry['knowledge']}`\n")
        parameters = entry.get("parameters", {})
        if parameters:
            parts.append(_parameter_table(parameters, said))
        for preset, values in entry.get("presets", {}).items():
            differing = ", ".join(f"`{key}={value}`" for key, value in values.items()) or "the defaults above"
            parts.append(f"Preset `{preset}`: {differing}\n")
    return "\n".join(parts)


def _parameter_table(parameters: Mapping[str, Any], said: Mapping[str, str]) -> str:
    """Parameters with their defaults, and what is said of them or which values there are, if anything."""
    defaults = [f"`{v['default']}`" if "default" in v else "(to be given)" for v in parameters.values()]
    meanings = [_meaning(said.get(name, ""), values) for name, values in parameters.items()]
    names = [f"`{name}`" for name in parameters]
    if not any(meanings):
        return table(("parameter", "default"), zip(names, defaults))
    return table(("parameter", "default", "what it is"), zip(names, defaults, meanings))


def _meaning(said: str, values: Mapping[str, Any]) -> str:
    choices = " | ".join(f"`{choice}`" for choice in values.get("choices", ()))
    return escape(said) + (f" ({choices})" if said and choices else choices).replace("|", "\\|")


_PARAMETER = re.compile(r"^(\w+(?:, \w+)*) {2,}(.+)$")


def _split_parameters(doc: str) -> tuple[str, dict[str, str]]:
    """A docstring without the columns that describe its parameters, and these by name."""
    text, said, last = [], dict[str, str](), []
    for line in doc.splitlines():
        found = _PARAMETER.match(line)
        if found:
            last = found.group(1).split(", ")
            said |= dict.fromkeys(last, found.group(2))
        elif last and line.startswith("   "):
            said |= {name: f"{said[name]} {line.strip()}" for name in last}
        else:
            last = []
            text.append(line)
    return escape("\n".join(text)).strip(), said


def metric_page() -> str:
    """Every metric with its unit, which way is worse, and when it is absent."""
    from trust_env.metrics import METRICS
    from trust_env.training.evaluation.overview import COLUMNS

    rows = []
    for metric in METRICS.values():
        absent = metric.absent or "never"
        if metric.never_where:
            absent += f"; where `{metric.never_where}` is there, absent means *never*"
        rows.append((f"`{metric.name}`", metric.unit, metric.worse, escape(metric.definition), escape(absent)))
    shown = [(column.heading, escape(column.meaning)) for column in COLUMNS.values()]
    return "\n".join([
        "# Metrics\n",
        "Evaluations use these and never rewards. `evaluate` prints an overview, `--metric all` everything, with "
        "means, the mean of the worst tenth and interquartile means, each with its 95 % bootstrap interval; "
        "`results.parquet` has a row per episode. An absent value is `NaN` in arrays and null in files.\n",
        "## The overview of `evaluate`\n",
        table(("column", "meaning"), shown),
        "## All metrics\n",
        table(("metric", "unit", "worse", "definition", "absent"), rows),
    ])  # fmt: skip


def threat_page() -> str:
    """The named threat models."""
    from trust_env.training.exploitation.threat_models import THREATS

    columns = ("share", "knowledge", "coordination", "injections", "suppressions")
    rows = [
        (f"`{label}`", escape(model.description), *(_most(getattr(model, column)) for column in columns))
        for label, model in THREATS.items()
    ]
    return "\n".join([
        "# Threat models by name\n",
        "What adversaries are, observe and may do, by name and version: `trust-env exploit --threat own@1`. "
        "[What an attacker can do at all](../threat-model.md).\n",
        table(("threat model", "in a line", "share of the agents", *columns[1:]), rows),
        "Empty budgets are bounded by the scenario only.\n",
    ])  # fmt: skip


def _most(value: Any) -> str:
    return "" if value is None else f"{value:.0%}" if isinstance(value, float) else f"`{value}`"


def space_page() -> str:
    """What agents observe and do, as the tables from which the spaces are made."""
    import trust_env
    from trust_env.spaces.action import SLOT

    env = trust_env.parallel_env({"base": "patrol", "knowledge": "white_box", "coordination": "shared"}, "score")
    levels = {level: trust_env.parallel_env(f"patrol(knowledge={level})", "score") for level in
              ("own", "poses", "picture", "white_box")}  # fmt: skip
    injections = (
        f"{env.action_table.slots} injection slots of {', '.join(SLOT)}; x and y over the box around the own FOV"
    )
    actions = {"injections": injections, "suppressions": "one entry for each own detection, nearest first"}
    sizes = [(f"`{level}`", str(one.observation_table.size)) for level, one in levels.items()]
    return "\n".join([
        "# What agents observe and do\n",
        "## Actions\n",
        "A `Box(-1, 1)` per agent. Of the scenario `patrol`:\n",
        table(("entries", "what they are"), [
            (f"{s.start}:{s.stop}", actions[name]) for name, s in env.action_table.items()
        ]),
        "\nA slot fires when its first entry is above 0; a detection is suppressed when its entry is. The zero action "
        "is the honest one. What exceeds an agent's budget has no effect.\n",
        "## Observations\n",
        "Flat float32 vectors in [-1, 1]. How long they are depends on the scenario's `knowledge`; of `patrol`:\n",
        table(("knowledge", "entries"), sizes),
        "All fields, at `white_box` with `coordination: shared`:\n",
        env.observation_table.markdown(),
        '\n`env.observation_table.read(observation, "detections")` gives a field in metres.\n',
    ])  # fmt: skip


def command_page() -> str:
    """The help of every command."""
    from trust_env.training.cli.main import COMMANDS
    from trust_env.training.cli.options import Group

    parts = ["# Commands\n", f"```text\n{_help([])}\n```\n"]
    for name, command in COMMANDS.items():
        paths = [[name, inner] for inner in command.commands] if isinstance(command, Group) else [[name]]
        parts.append(f"## {name}\n")
        parts += [f"```text\n{_help(path)}\n```\n" for path in paths]
    return "\n".join(parts)


def _help(path: list[str]) -> str:
    from trust_env.training.cli.main import main

    written, before = io.StringIO(), dict(os.environ)
    os.environ |= {"COLUMNS": "80", "NO_COLOR": "1", "TERM": "dumb"}
    try:
        with contextlib.redirect_stdout(written), contextlib.suppress(SystemExit):
            main([*path, "--help"])
    finally:
        os.environ.clear()
        os.environ |= before
    return re.sub(r"\x1b\[[0-9;]*m", "", written.getvalue()).strip()


def training_page() -> str:
    """The defaults of training."""
    from importlib import resources

    text = (resources.files("trust_env.training.learning") / "defaults.yaml").read_text("utf-8")
    return (
        "# The configuration of training\n\nA file of your own (`trust-env train --config my.yaml`) says what differs; "
        f"`--set ppo.gamma=0.95` changes a field.\n\n```yaml\n{text}```\n"
    )


def tutorial_pages() -> dict[str, str]:
    """The notebooks, as pages, with what their cells printed when they were saved."""
    import nbformat

    pages = {}
    for file in sorted((DOCS / "tutorials").glob("*.ipynb")):
        notebook = nbformat.read(file, as_version=4)
        parts = [part for cell in notebook.cells for part in _cell(cell)]
        parts.append(f"\n*This page is the notebook `docs/tutorials/{file.name}`, which the tests run.*\n")
        pages[f"tutorials/{file.stem}.md"] = "\n".join(parts)
    return pages


def _cell(cell: Any) -> Iterable[str]:
    if cell.cell_type == "markdown":
        yield cell.source + "\n"
        return
    yield f"```python\n{cell.source}\n```\n"
    text = "".join(output.get("text", "") for output in cell.outputs)
    if text:
        yield f"```text\n{text.rstrip()}\n```\n"


def results_tables() -> str:
    """The tables in docs/tables, which commands wrote, one below the other: those of whole scenarios first."""
    files = sorted((DOCS / "tables").glob("*.md"), key=lambda file: (not _FIRST.fullmatch(file.stem), file.stem))
    return "\n\n".join(file.read_text(encoding="utf-8").strip() for file in files)


_FIRST = re.compile(r"[a-z]+(_worst|_joint)?")

PAGES: dict[str, Callable[[], str]] = {
    "reference/scenarios.md": scenario_pages,
    "reference/attacks.md": attack_page,
    "reference/defenses.md": defense_page,
    "reference/metrics.md": metric_page,
    "reference/threats.md": threat_page,
    "reference/spaces.md": space_page,
    "reference/commands.md": command_page,
    "reference/training.md": training_page,
}


def all_pages() -> dict[str, str]:
    """Every generated page by its path below the pages' folder."""
    return {path: make() for path, make in PAGES.items()} | tutorial_pages()


def table(heads: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table."""
    lines = [heads, tuple("---" for _ in heads), *rows]
    return "\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def escape(text: str) -> str:
    """Text in which no sign outside code spans means anything to Markdown, and none to a table."""
    parts = text.split("`")
    plain = [re.sub(r"([|<>*_\[\]])", r"\\\1", part) if i % 2 == 0 else part for i, part in enumerate(parts)]
    return "`".join(plain)


def _default(value: Any) -> str:
    return "null" if value is None else f"`{value}`"


if __name__ == "__main__":
    sys.stdout.write("\n".join(all_pages()))
