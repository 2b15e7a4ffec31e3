#!/usr/bin/env bash
# Scores every submission anew and compares the table with the one in git. A pull request with a submission runs this.
# Uses an environment that is there, such as .venv, or makes one: LOWALT=/path/to/lowalt .ci/submissions.sh [FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:-results/reference/lowalt-40-v1/submissions}
lowalt=${LOWALT:-.venv/bin/lowalt}
kept=$(mktemp)
trap 'rm -f "$kept"' EXIT
cp "$folder/submissions.csv" "$kept"
"$lowalt" benchmark submissions "$folder"
if ! diff -u "$kept" "$folder/submissions.csv"; then
  echo "$folder/submissions.csv: differs from the scores of the files; run \`lowalt benchmark submissions\` and commit it" >&2
  exit 1
fi
