#!/usr/bin/env bash
# Installs the wheel beside openai-agents, whose own package is named `agents`, and runs both; then trust-env alone
# from a folder where `agents` and `training` are somebody else's. In a new virtual environment; needs the network.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export NUMBA_CACHE_DIR=$scratch/cache
"${PYTHON:-python3}" -m venv "$scratch/venv"
python=$scratch/venv/bin/python
pip() { "$python" -m pip --disable-pip-version-check "$@"; }

# What is committed, as somebody else would get it.
git clone --quiet "$root" "$scratch/clone"
pip wheel --quiet --no-deps --wheel-dir "$scratch" "$scratch/clone"
# The last one installed could overwrite the files of the first.
pip install --quiet -c "$root/constraints.txt" "$scratch"/trust_env-*.whl
pip install --quiet openai-agents

mkdir -p "$scratch/script/agents" "$scratch/script/training" "$scratch/elsewhere"
for name in agents training; do
    echo "raise ImportError('$name: not the one that was meant')" >"$scratch/script/$name/__init__.py"
done
cat >"$scratch/script/main.py" <<'END'
from trust_env import parallel_env, training
from trust_env.agents import Player, policies

assert "false_positive" in policies() and callable(training.evaluate)
env = parallel_env(scenario="trio", defense="trust")
env.reset(seed=0)
env.close()
END
cat >"$scratch/elsewhere/main.py" <<'END'
import agents
import trust_env.agents

assert agents.Agent(name="helper").name == "helper"
assert "false_positive" in trust_env.agents.policies()
END
for folder in script elsewhere; do
    cd "$scratch/$folder"
    "$python" main.py # the folder of a script is the first on its path
    "$scratch/venv/bin/trust-env" evaluate --scenario trio --defense trust --episodes 2 >/dev/null
done
