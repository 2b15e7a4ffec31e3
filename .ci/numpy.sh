#!/bin/sh
# Build the tiny data set with the oldest and the newest NumPy that pyproject.toml allows, or with the versions given,
# and compare it with its manifest: .ci/numpy.sh [VERSION ...]; PYTHON names the interpreter.
set -e
NUMPYS="2.0.0 2.4.6"
for version in ${*:-$NUMPYS}; do
    env=.venv/numpy-$version
    if ! test -e "$env/ready"; then
        "${PYTHON:-python3}" -m venv "$env"
        grep -v '^numpy==' envs/constraints.txt > "$env/pins"
        "$env/bin/python" -m pip install --quiet --disable-pip-version-check -c "$env/pins" "numpy==$version" \
            scipy numba pillow deflate matplotlib pyyaml jsonschema
        touch "$env/ready"
    fi
    rm -rf "$env/tiny"
    # Machine code compiled with one NumPy is not tried with another.
    export PYTHONPATH=src NUMBA_CACHE_DIR="$env/numba"
    "$env/bin/python" -m lowalt.shards.build --config config/default.yaml config/tiny.yaml --out "$env/tiny"
    "$env/bin/python" -m lowalt.shards.manifest check --run "$env/tiny" --manifest results/reference/tiny.sha256 \
        --without echo noise
    echo "NumPy $version: equal"
done
