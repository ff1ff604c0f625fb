#!/usr/bin/env bash
# The tests once more, on the newest Python that is there: on PATH or among pyenv's.
set -euo pipefail
cd "$(dirname "$0")/.."

# What pyenv puts on PATH itself may be a Python it does not run.
newest() {
    local name found
    for name in python3.14 python3.13; do
        for found in "$(type -P "$name")" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/*/bin/"$name"; do
            if [ -n "$found" ] && "$found" -c 'import venv, ensurepip' 2>/dev/null; then
                echo "$found"
                return
            fi
        done
    done
}

python=$(newest)
if [ -z "$python" ]; then
    echo "NOT TESTED ON THE NEWEST PYTHON: neither python3.14 nor python3.13 is on PATH or under pyenv" >&2
    exit 0
fi
echo "The tests again, on $("$python" --version)"
# Not again: what is marked `once`, as numbers, geometry and pictures are (CONTRIBUTING.md says what is).
"${MAKE:-make}" suite PYTHON="$python" VENV=".venv-${python##*/python}" SELECT="-m 'not nightly and not once'"
