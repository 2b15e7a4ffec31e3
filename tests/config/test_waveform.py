"""The block network.waveform: what a sweep or a continuous wave is in OFDM's terms, and what
contradicts it.
"""

import copy
from dataclasses import replace
from pathlib import Path

import pytest

from lowalt.config.layers import check, load, merge
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.shards.sizes import sample_bytes
from tables import rows

ROOT = Path(__file__).parents[2]
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
DEFAULT = load([ROOT / "config/default.yaml"], SCHEMA)
SWEEP = {"kind": "fmcw", "sweep_hz": 150e6, "sweep_s": 2e-3, "samples": 128}


def checked(network: dict) -> dict:
    """The default with changes of its block `network`, checked."""
    return check(merge(copy.deepcopy(DEFAULT), {"network": network}), SCHEMA)


def built(network: dict) -> Network:
    """The network of that configuration."""
    return Network.from_settings(checked(network)["network"])


@pytest.mark.parametrize(
    ("waveform", "kind", "sweep_s", "ofdm", "symbol_rate_hz", "noise_bandwidth_hz"),
    [
        (SWEEP, "fmcw", 2e-3, (128, 150e6 / 128, 0), 500.0, 64e3),
        ({"kind": "cw"}, "cw", None, (1, 400.0, 0), 400.0, 400.0),
        ({"kind": "ofdm"}, "ofdm", None, (256, 120e3, 10), 120e3, 120e3),
    ],
)
def test_a_waveform_says_its_band_in_its_own_terms(
    waveform, kind, sweep_s, ofdm, symbol_rate_hz, noise_bandwidth_hz
):
    keys = ("subcarriers", "subcarrier_spacing_hz", "guard_subcarriers")
    found = built({"waveform": waveform})
    assert found == replace(
        built(dict(zip(keys, ofdm, strict=True))), waveform=kind, sweep_s=sweep_s
    )
    assert (found.symbol_rate_hz, found.noise_bandwidth_hz) == pytest.approx(
        (symbol_rate_hz, noise_bandwidth_hz)
    )


def test_the_defaults_subcarriers_go_and_ofdm_by_name_leaves_no_trace():
    sweeping = checked({"waveform": SWEEP})
    assert {"subcarriers", "subcarrier_spacing_hz", "guard_subcarriers"}.isdisjoint(
        sweeping["network"]
    )
    # A run writes its configuration into its folder, and reads it again.
    assert (
        check(copy.deepcopy(sweeping), SCHEMA)
        == check(merge(DEFAULT, sweeping), SCHEMA)
        == sweeping
    )
    assert checked({"waveform": {"kind": "ofdm"}}) == checked({"waveform": None}) == DEFAULT


def test_cubes_have_a_range_cell_for_each_sample():
    cubes = {"shards": {"kind": "cube"}}
    sweeping, same = (
        sample_bytes(merge(checked(network), cubes))
        for network in ({"waveform": SWEEP}, {"subcarriers": 128})
    )
    assert sweeping == same < sample_bytes(merge(DEFAULT, cubes))


@pytest.mark.parametrize(
    ("network", "words"),
    rows("waveforms", "networks"),
)
def test_what_contradicts_a_waveform_is_refused_in_one_sentence(network, words):
    with pytest.raises(InputError, match=words) as refused:
        built(network)
    assert "\n" not in str(refused.value)
