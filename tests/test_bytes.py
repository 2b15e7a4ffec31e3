"""The same bytes on every processor: a chunk and a small data set in short, the whole tiny one in
full.
"""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from emulation import EMULATED, able, run
from lowalt.config.layers import load
from lowalt.shards import build, manifest
from lowalt.shards.dataset import Dataset

ROOT = Path(__file__).parent.parent
REFERENCE = ROOT / "results/reference/tiny.sha256"
NAMES = [
    pytest.param(name, marks=pytest.mark.skipif(not able(name), reason=f"no {name} here"))
    for name in EMULATED
]

SMALL = ("config/default.yaml", "config/tiny.yaml", "tests/data/small.yaml")


def test_signals_of_a_small_data_set_are_those_of_another_processor(tmp_path):
    """Clouds, motion tables, shards, their tables and the index, on the processor that can do
    least.
    """
    config = ("--config", *SMALL)
    build.main([*config, "--out", str(tmp_path / "here")])
    run("x86-64-v2", "-m", "lowalt.shards.build", *config, "--out", str(tmp_path / "there"))
    expected = manifest.text(tmp_path / "here")
    assert (
        expected.count("\n") == 4 + 2 + 2 * 2 + 1 and manifest.text(tmp_path / "there") == expected
    )


def test_echoes_noise_and_shards_with_tiles_of_a_chunk_have_their_stored_checksums(tmp_path):
    """One chunk of the tiny data set; the stored values hold on every processor. A shard has the
    tiles as PNG files.
    """
    dataset = Dataset(
        load(["config/default.yaml", "config/tiny.yaml"], "workflow/schemas/config.schema.yaml")
    )
    chunk = "seen-00000"
    stored = manifest.read(REFERENCE)
    build.write_chunk(dataset, tmp_path, chunk, "image")
    rows = build.rows_of(dataset, chunk)
    levels = dataset.plan.chunk(chunk).snrs
    maker = dataset.maker
    made = {
        f"noisy/{chunk}.npy": np.array([[maker.signal(row, snr) for snr in levels] for row in rows])
    }
    for place, station in enumerate(maker.network.stations):
        made[f"echo/{chunk}/{station.name}.npy"] = np.array(
            [maker.received(row)[0][place] for row in rows]
        )
    for name, values in made.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        np.save(tmp_path / name, values)
    lines = [line.partition("  ") for line in manifest.text(tmp_path).splitlines()]
    found = {name: digest for digest, _, name in lines}
    assert set(found) == {
        name for name in stored if re.match(r"(motion|echo|noisy|shards)/seen-", name)
    }
    for name, digest in found.items():
        assert digest == stored[name], name


def test_emulation_leaves_instructions_out():
    """Without this the tests above would compare a processor with itself."""
    program = "import numpy as np, json; from numba.core.registry import cpu_target as t;"
    program += "from numpy._core._multiarray_umath import __cpu_features__ as f;"
    program += (
        "print(json.dumps([bool(f.get('X86_V3', f['FMA3'])),"
        " t.target_context.codegen().magic_tuple()[1]]))"
    )
    fused, name = json.loads(run("x86-64-v2", "-c", program))
    assert not fused and name == "nehalem"


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("name", ["native", *NAMES])
def test_the_tiny_data_set_has_the_bytes_of_its_manifest(name, threads, tmp_path):
    config = ("config/default.yaml", "config/tiny.yaml")
    run(
        name,
        "-m",
        "lowalt.shards.build",
        "--config",
        *config,
        "--out",
        str(tmp_path / "run"),
        threads=threads,
    )
    # Echoes and noisy signals stay in memory here; the shards follow from them.
    assert manifest.faults(REFERENCE, tmp_path / "run", ("echo", "noise", "tiles")) == []
