"""All defenses under one protocol: the quick ranking, the full one, and whether a published one is reproduced.

found = rank("quick", defenses="my_file.py:Mine", out="RUN")      # every built-in defense and Mine
rank("full", out="RUN")                                           # hours: searches and training against each
check("rankings/v1/quick.json", only="score")                     # a few rows played anew, compared with the file
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from trust_env.defenses import build_defense, named_in_full
from trust_env.errors import unknown_name
from trust_env.files import expanded, locked, remove_unfinished, require_empty
from trust_env.spec import split_specs
from trust_env.training.evaluation.configuration import named_specs
from trust_env.training.exploitation.threat_models import threat_model
from trust_env.training.ranking.check import Check, check_ranking
from trust_env.training.ranking.full import full_rows
from trust_env.training.ranking.quick import quick_rows
from trust_env.training.ranking.ranking import Ranking, header, load_ranking
from trust_env.training.ranking.version import LATEST, Version, load_version

KINDS = ("quick", "full")


def rank(
    kind: str = "quick",
    defenses: str | Sequence[str] = (),
    attacks: str | Sequence[str] = (),
    only: str | Sequence[str] = (),
    scenarios: str | Sequence[str] = (),
    threats: str | Sequence[str] = (),
    version: str | Version = str(LATEST),
    out: str | Path | None = None,
    resume: bool = False,
    progress: bool = True,
) -> Ranking:
    """Every defense of a version, and those given, under its protocol; on the same episodes.

    kind: `quick`, the version's list of attacks; `full`, search and training against each defense by `exploit`.
    defenses, attacks: names with commas or a list, `my_file.py:Mine`, that join those of the version; such an attack
    may become the worst one of a row, but does not count in its means. only, scenarios, threats: of the defenses,
    scenarios and threat models, just these. version: a number, or a YAML file like that of a version. out: a new or
    empty folder for quick.json and quick.md (full.json and full.md) and for what is finished on the way; `resume`
    continues there. `full` needs it.

    Raises ValueError for what cannot be played, before anything is, OSError for a folder that cannot be written.
    """
    if kind not in KINDS:
        raise unknown_name("kind of ranking", kind, KINDS)
    whole = version if isinstance(version, Version) else load_version(version)
    if kind == "full":
        whole = whole.model_copy(update={"threats": whole.full.threats})
    protocol = _chosen(whole, _names(scenarios), _names(threats))
    joined, more_attacks = _joined(whole, _names(defenses)), _names(attacks)
    for text in more_attacks:
        protocol.require_playable(text)
    ranked = _only([*whole.defenses, *joined], _names(only))
    if kind == "full" and out is None:
        raise ValueError("rank full: expected out, a new or empty folder: it takes hours, and goes on from there")
    folder = None if out is None else expanded(out)
    with nullcontext() if folder is None else locked(folder):
        if folder is not None and not resume:
            require_empty(folder, "--resume to continue the ranking in it")
        if folder is not None:
            remove_unfinished(folder)
        if folder is None or kind == "quick":
            rows = quick_rows(protocol, ranked, more_attacks, folder, progress)
        else:
            rows = full_rows(protocol, ranked, more_attacks, folder, progress)
        fields = header(kind, protocol.model_dump(mode="json"))
        options = {"defense": joined, "attack": more_attacks, "only": _names(only), "scenario": _names(scenarios)}
        options["threat"] = _names(threats)
        fields["options"] = {name: given for name, given in options.items() if given}
        fields["rows"] = [row.to_dict() for row in rows]
        found = Ranking(fields)
        if folder is not None:
            found.save(folder)
    return found


def check(file: str | Path, only: str | Sequence[str] = (), progress: bool = True) -> Check:
    """Play the rows of a quick ranking again, all or those of some defenses and of the references, and compare them.

    Values are compared to the bit where the file was made on the same type of processor, else to 1e-9; times are not.
    ValueError: the file holds no quick ranking, or one of another version of the environment.
    """
    saved = load_ranking(expanded(file))
    fields = saved.fields
    if fields["kind"] != "quick":
        raise ValueError(f"{file}: a {fields['kind']} ranking; expected a quick one, which can be played again")
    here = header("quick", fields["protocol"])["environment"]
    if fields["environment"] != here:
        raise ValueError(f"{file}: results of {fields['environment']}; expected those of {here}")
    version, options = Version.model_validate(fields["protocol"]), fields["options"]
    more = options.get("defense", ()), options.get("attack", ())
    ranked = [row["defense"] for row in saved.rows if not row["reference"]]
    known = [named_in_full(name) for name in _names(only)] or list(dict.fromkeys(ranked))
    missing = sorted(set(known) - set(ranked))
    if missing:
        raise unknown_name("defense of the ranking", missing[0], ranked)
    return check_ranking(saved, rank("quick", *more, only=known, version=version, progress=progress))


def _names(given: str | Sequence[str]) -> list[str]:
    return list(split_specs(given)) if isinstance(given, str) else list(given)


def _chosen(version: Version, scenarios: list[str], threats: list[str]) -> Version:
    """The version with some of its scenarios and threat models."""
    labels = [threat_model(text).label for text in threats]
    for kind, names, known in (("scenario", scenarios, version.scenarios), ("threat model", labels, version.threats)):
        for name in names:
            if name not in known:
                raise unknown_name(f"{kind} of version {version.version}", name, known)
    update = {"scenarios": tuple(scenarios) or version.scenarios, "threats": tuple(labels) or version.threats}
    return version.model_copy(update=update)


def _joined(version: Version, defenses: list[str]) -> list[str]:
    """Defenses that the version does not list, all of which can be built."""
    if not defenses:
        return []
    known = [named_in_full(name) for name in (*version.defenses, *version.references)]
    return [one.name for one in named_specs("defense", defenses, build_defense) if one.name not in known]


def _only(defenses: list[str], only: list[str]) -> list[str]:
    """Those of the defenses that are named, or all."""
    in_full = {named_in_full(name): name for name in defenses}
    for name in only:
        if named_in_full(name) not in in_full:
            raise unknown_name("defense of the ranking", name, defenses)
    return [in_full[named_in_full(name)] for name in only] or defenses
