#!/bin/sh
# Make the tiny data set with one version of Snakemake and compare it with its manifest: .ci/snakemake.sh PYTHON VERSION
# Packages that data need have their pins; Snakemake brings its own, since an older one may refuse newer pins.
set -e
env=.venv/snakemake-$2
if ! test -e "$env/ready"; then
    "$1" -m venv "$env"
    grep -iE '^(numpy|scipy|numba|pillow|deflate|matplotlib|jsonschema|trimesh|networkx)==' envs/constraints.txt > "$env/pins"
    "$env/bin/python" -m pip install --quiet --disable-pip-version-check -c "$env/pins" "snakemake==$2" \
        'snakemake-interface-logger-plugins>=2.1' numpy scipy numba pillow deflate matplotlib pyyaml jsonschema jinja2 trimesh networkx
    touch "$env/ready"
fi
export PYTHONPATH=src
"$env/bin/snakemake" --cores all --forceall --configfile config/tiny.yaml -- data
"$env/bin/python" -m lowalt.shards.manifest check --run results/tiny --manifest results/reference/tiny.sha256
echo "Snakemake $2: equal"
