#!/usr/bin/env bash
# Tests the examples of the libraries that cannot be installed beside the others, each in a virtual environment
# of its own: tests/clients/own_environments.sh [agilerl] [benchmarl]. It takes minutes; CI does not run it.
set -euo pipefail
cd "$(dirname "$0")/../.."

# What the library asks for in versions other than ours, and what goes by its version.
declare -A packages=(
    # 2.58 imports peft, but does not ask for it.
    [agilerl]="agilerl==2.58.0 peft==0.21.2 pettingzoo<1.27"
    [benchmarl]="benchmarl==1.5.2"
)
declare -A theirs=([agilerl]="pettingzoo|tensordict" [benchmarl]="torchrl|tensordict")

(($#)) || set -- agilerl benchmarl
for library in "$@"; do
    venv=.venv-$library
    test -d "$venv" || "${PYTHON:-python3}" -m venv "$venv"
    pins=$(mktemp)
    grep -vE "^(${theirs[$library]})==" constraints.txt >"$pins"
    # shellcheck disable=SC2086 # a list
    "$venv/bin/python" -m pip --disable-pip-version-check install --quiet -c "$pins" \
        -e . ${packages[$library]} "torch==$(sed -n 's/^torch==//p' constraints.txt)" safetensors pytest
    rm "$pins"
    TRUST_ENV_REQUIRE_EXTRAS=$library WANDB_MODE=disabled \
        "$venv/bin/python" -m pytest "tests/clients/test_$library.py"
done
