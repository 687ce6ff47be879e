#!/usr/bin/env bash
# Runs test_smoke.py with other versions of Numba: tests/compiled/numba_versions.sh [VERSION | newest ...]
# Without arguments: with the oldest that pyproject.toml allows, and the newest there is.
# Each has a virtual environment of its own, which holds the core dependencies alone.
set -uo pipefail
cd "$(dirname "$0")/../.."

oldest=$(sed -n 's/.*"numba>=\([0-9.]*\)".*/\1/p' pyproject.toml)
(($#)) || set -- "$oldest" newest

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# These three go by the version of Numba.
grep -vE '^(numba|llvmlite|numpy)==' constraints.txt >"$scratch/pins"

smoke_test() {
    local numba=numba==$1 venv=$scratch/$1
    [[ $1 == newest ]] && numba=numba
    "${PYTHON:-python3}" -m venv "$venv" || return
    "$venv/bin/python" -m pip --disable-pip-version-check install --quiet -c "$scratch/pins" \
        -e . "$numba" pytest || return
    "$venv/bin/python" -c "import numba, numpy; print('numba', numba.__version__, 'numpy', numpy.__version__)"
    export NUMBA_CACHE_DIR=$venv/cache # a new one
    "$venv/bin/python" -m pytest -q tests/compiled/test_smoke.py || return
    "$venv/bin/python" -m pytest -q tests/compiled/test_smoke.py # with what the first run has compiled
}

failed=()
for version in "$@"; do
    echo "=== numba $version"
    smoke_test "$version" || failed+=("$version")
done
if ((${#failed[@]})); then
    echo "FAILED with numba: ${failed[*]}"
    exit 1
fi
