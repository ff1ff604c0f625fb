#!/bin/sh
# wheel.sh WHEEL: installs a repaired wheel in a new venv and uses it.
set -eu
wheel=$(realpath "$1")
check=$(realpath "$(dirname "$0")/wheel.py")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
cd "$folder"
venv/bin/pip install --quiet "$wheel"
venv/bin/python "$check"
