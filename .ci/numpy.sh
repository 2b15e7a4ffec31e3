#!/bin/sh
# Build the tiny data set with one version of NumPy and compare it with its manifest: .ci/numpy.sh PYTHON VERSION
set -e
env=.venv/numpy-$2
if ! test -e "$env/ready"; then
    "$1" -m venv "$env"
    grep -v '^numpy==' envs/constraints.txt > "$env/pins"
    "$env/bin/python" -m pip install --quiet --disable-pip-version-check -c "$env/pins" "numpy==$2" \
        scipy numba pillow deflate matplotlib pyyaml jsonschema
    touch "$env/ready"
fi
rm -rf "$env/tiny"
# Machine code compiled with one NumPy is not tried with another.
export PYTHONPATH=src NUMBA_CACHE_DIR="$env/numba"
"$env/bin/python" -m lowalt.shards.build --config config/default.yaml config/tiny.yaml --out "$env/tiny"
"$env/bin/python" -m lowalt.shards.manifest check --run "$env/tiny" --manifest results/reference/tiny.sha256 \
    --without echo noise
echo "NumPy $2: equal"
