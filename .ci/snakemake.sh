#!/bin/sh
# Make the tiny data set with the oldest Snakemake that pyproject.toml allows, or another, and compare it with its
# manifest: .ci/snakemake.sh [VERSION]; PYTHON names the interpreter.
# Packages that data need have their pins; Snakemake brings its own, since an older one may refuse newer pins.
set -e
OLDEST_SNAKEMAKE=9.23.0
version=${1:-$OLDEST_SNAKEMAKE}
env=.venv/snakemake-$version
if ! test -e "$env/ready"; then
    "${PYTHON:-python3}" -m venv "$env"
    grep -iE '^(numpy|scipy|numba|pillow|deflate|matplotlib|jsonschema|trimesh|networkx)==' envs/constraints.txt > "$env/pins"
    "$env/bin/python" -m pip install --quiet --disable-pip-version-check -c "$env/pins" "snakemake==$version" \
        'snakemake-interface-logger-plugins>=2.1' numpy scipy numba pillow deflate matplotlib pyyaml jsonschema jinja2 trimesh networkx
    touch "$env/ready"
fi
export PYTHONPATH=src
"$env/bin/snakemake" --cores all --forceall --configfile config/tiny.yaml -- data
"$env/bin/python" -m lowalt.shards.manifest check --run results/tiny --manifest results/reference/tiny.sha256
echo "Snakemake $version: equal"
