"""Cost of the larger scales (`docs/scale_table.py`): what a finished run took, times what a
configuration asks for.
"""

import pytest
import scale_table

from lowalt.config.layers import load
from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.files.errors import InputError

SCHEMA = "workflow/schemas/config.schema.yaml"
STAGES = [
    {"rule": rule, "wall_s": "100", "samples": "1000", "sample_bytes": "250000", "hardware": "here"}
    for rule in scale_table.DATA_RULES
]


def config(name):
    return load(["config/default.yaml", f"config/{name}.yaml"], SCHEMA)


def test_samples_and_bytes_are_scaled_and_a_recipe_keeps_one_signal_of_all_snrs():
    asked = config("paper")
    samples = 1_440_000
    signal = 8 * 400 * 3
    for kind, size, stages in (
        ("image", 250_000, 6),
        ("signal", signal, 5),
        ("recipe", signal / 6, 4),
    ):
        row = scale_table.estimate(STAGES, [], asked | {"shards": {"kind": kind}}, "paper")
        assert (row["motion_models"], row["samples"], row["trainings"]) == (240_000, samples, 17)
        assert row["core_hours"] == pytest.approx(100 * stages / 1000 * samples / 3600, abs=0.01)
        assert (row["shards_gb"], row["noisy_gb"]) == (
            round(size * 1.44e-3, 1),
            round(signal * 1.44e-3, 1),
        )
        assert row["training_core_hours"] == ""
    with pytest.raises(InputError, match="index"):
        scale_table.estimate(STAGES[:-1], [], asked, "paper")


def test_training_scales_with_images_and_a_network_that_was_not_timed_on_all_of_them_is_not_guessed_at():
    asked = config("workstation")
    timed = {
        "backbone": "swin_tiny_patch4_window7_224",
        "pixels": "224",
        "network_bytes": str(9 * 224**2),
        "train_ms": "900",
        "hardware": "x",
    }
    few = {**timed, "network_bytes": str(3 * 224**2), "train_ms": "7"}
    # Both protocols: three schemes of one image, three of three, one of nine; mean fusion in one
    # protocol only.
    images = 2 * (3 * 1 + 3 * 3 + 9) + 9
    hours = images / 9 * 30000 * 64 * 0.9 / 3600
    assert scale_table.training_hours([few, timed], asked) == (15, pytest.approx(hours), "x")
    other = {**timed, "pixels": "64", "network_bytes": str(9 * 64**2)}
    for costs in ([], [other], [few, other], [{**timed, "train_ms": ""}]):
        assert scale_table.training_hours(costs, asked) == (15, None, "")


def test_the_command_writes_a_row_of_every_overlay(tmp_path):
    write_csv(tmp_path / "stages.csv", list(STAGES[0]), STAGES)
    write_csv(tmp_path / "costs.csv", scale_table.COST_COLUMNS, [])
    scale_table.main(
        [
            "--stages",
            str(tmp_path / "stages.csv"),
            "--costs",
            str(tmp_path / "costs.csv"),
            "--out",
            str(tmp_path / "scale.csv"),
            "--schema",
            SCHEMA,
            "--base",
            "config/default.yaml",
            "--overlays",
            "config/tiny.yaml",
            "config/paper.yaml",
        ]
    )
    rows = read_csv(tmp_path / "scale.csv", "configuration", "samples", "measured_on")
    assert [(row["configuration"], row["measured_on"]) for row in rows] == [
        ("tiny", "here"),
        ("paper", "here"),
    ]
