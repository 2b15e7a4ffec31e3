#!/bin/sh
# Build the tiny data set on a 64-bit ARM processor that qemu emulates, and compare it with its manifest: .ci/arm.sh [FOLDER]
# Debian on x86-64, as root: emulator and ARM's Python come from Debian's packages, ARM's wheels from the package index,
# all into FOLDER. Nothing is installed on this machine. Ten minutes of one core, most of them compiling kernels.
set -e
folder=$(realpath -m "${1:-.venv/arm}")
mkdir -p "$folder/state/lists/partial" "$folder/cache/archives/partial" "$folder/root" "$folder/host"
if ! test -e "$folder/ready"; then
    (cd "$folder/host" && apt-get download qemu-user-static && dpkg -x qemu-user-static*.deb .)
    touch "$folder/state/status"
    apt() {
        apt-get -qq -o APT::Architecture=arm64 -o APT::Architectures=arm64 -o Dir::State="$folder/state" \
            -o Dir::State::status="$folder/state/status" -o Dir::Cache="$folder/cache" -o Debug::NoLocking=1 "$@"
    }
    apt update
    apt install -y --no-install-recommends --download-only python3.11 libpython3.11-stdlib libstdc++6 libgomp1
    for package in "$folder"/cache/archives/*.deb; do dpkg -x "$package" "$folder/root"; done
    grep -v '^[-#]' envs/constraints.txt > "$folder/pins"
    .venv/bin/python -m pip download --quiet --disable-pip-version-check --only-binary=:all: --implementation cp \
        --python-version 3.11 --abi cp311 --abi abi3 --abi none --platform manylinux_2_28_aarch64 \
        --platform manylinux_2_27_aarch64 --platform manylinux_2_17_aarch64 --platform manylinux2014_aarch64 \
        -c "$folder/pins" -d "$folder/wheels" numpy scipy numba pillow deflate matplotlib pyyaml jsonschema
    for wheel in "$folder"/wheels/*.whl; do .venv/bin/python -m zipfile -e "$wheel" "$folder/site"; done
    touch "$folder/ready"
fi
rm -rf "$folder/tiny"
PYTHONHOME="$folder/root/usr" PYTHONPATH="$PWD/src:$folder/site" LD_LIBRARY_PATH="$folder/root/usr/lib/aarch64-linux-gnu" \
    NUMBA_CACHE_DIR="$folder/numba" PYTHONDONTWRITEBYTECODE=1 \
    "$folder/host/usr/bin/qemu-aarch64-static" -L "$folder/root" "$folder/root/usr/bin/python3.11" \
    -m lowalt.shards.build --config config/default.yaml config/tiny.yaml --out "$folder/tiny"
PYTHONPATH=src .venv/bin/python -m lowalt.shards.manifest check --run "$folder/tiny" --manifest results/reference/tiny.sha256 \
    --without echo noise
echo "AArch64: equal"
