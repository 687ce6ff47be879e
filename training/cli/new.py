"""Command line: new defense, attack, scenario."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from trust_env.files import write_atomically
from trust_env.training.cli.options import Group, Json, print_json

Name = Annotated[Positional[str], arg(help="my_thing, which is written to my_thing.py or my_thing.yaml")]
EVALUATE = "trust-env evaluate"
SCHEMA = "scenario.schema.json"  # the first line of the template names it


def new_defense(name: Name, as_json: Json = False) -> None:
    """Write a defense that runs, to be changed."""
    file, class_name = _write("defense.py", "MyDefense", name)
    named = f"{file}:{class_name}"
    compare = f'{EVALUATE} --attack honest,false_positive --defense "score,trust,{named}" --episodes 20'
    _tell(file, [compare, f'trust-env conform --scenario patrol --defense "{named}"'], as_json)


def new_attack(name: Name, as_json: Json = False) -> None:
    """Write an attack that runs, to be changed."""
    file, class_name = _write("attack.py", "MyAttack", name)
    compare = f'{EVALUATE} --attack "honest,false_positive,{file}:{class_name}" --defense score,trust --episodes 20'
    _tell(file, [compare, f'trust-env attacks show "{file}:{class_name}"'], as_json)


def new_scenario(name: Name, as_json: Json = False) -> None:
    """Write a scenario that can be played, to be changed, and beside it the JSON schema, for editors."""
    from trust_env.scenario.json_schema import scenario_schema

    file, _ = _write("scenario.yaml", "my_scenario", name)
    schema = json.dumps(scenario_schema(), indent=2) + "\n"
    write_atomically(file.with_name(SCHEMA), lambda unfinished: unfinished.write_text(schema, encoding="utf-8"))
    play = f"{EVALUATE} --scenario {file} --attack honest,false_positive --defense score,trust --episodes 20"
    look = f"trust-env replay --scenario {file} --attack false_positive --defense trust --out {file.stem}.html"
    _tell(file, [f"trust-env scenarios check {file}", play, look], as_json)


def _write(template: str, placeholder: str, name: str) -> tuple[Path, str]:
    """The file that is written, and what the class in it is called (of a scenario its name)."""
    suffix = Path(template).suffix
    path = Path(name).with_name(Path(name).name.removesuffix(suffix))
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", path.name).lower()
    if not words.isidentifier():
        raise ValueError(f"{name}: expected a name of letters, digits and _, such as my_thing")
    inner = "".join(word.capitalize() for word in words.split("_")) if suffix == ".py" else words
    file = path.with_name(words + suffix)
    text = (resources.files("trust_env.training") / "templates" / template).read_text(encoding="utf-8")
    file.parent.mkdir(parents=True, exist_ok=True)
    with open(file, "x", encoding="utf-8") as new:  # an existing file is never overwritten
        new.write(text.replace(placeholder, inner).replace("THIS_FILE", str(file)))
    return file, inner


def _tell(file: Path, commands: list[str], as_json: bool) -> None:
    if as_json:
        print_json({"file": str(file), "next": commands})
    else:
        print(f"{file} is written. What to do with it:", *(f"  {command}" for command in commands), sep="\n")


COMMANDS = Group(
    "Write a file to start from: defense, attack, scenario.",
    {"defense": new_defense, "attack": new_attack, "scenario": new_scenario},
)
