"""The configuration of a small data set: three subtypes of both groups, four motion models, two
SNRs.
"""

from pathlib import Path

from lowalt.config.layers import load

ROOT = Path(__file__).parents[2]
SUBTYPES = ["DJI Mini 2", "Owl", "Walking Pedestrian 5"]


def configuration(**changes) -> dict:
    """Three subtypes of both groups, four motion models, two SNRs."""
    paths = [ROOT / "config/default.yaml", ROOT / "config/tiny.yaml"]
    config = load(paths, ROOT / "workflow/schemas/config.schema.yaml")
    for name in ("table", "records"):
        value = config["targets"][name]
        there = (
            [str(ROOT / path) for path in value] if isinstance(value, list) else str(ROOT / value)
        )
        config["targets"][name] = there
    config["targets"]["select"] = SUBTYPES
    config["motion"] |= {"models": 4, "models_per_chunk": 4}
    config["split"] = {"by": "motion", "train": 2, "val": 1, "test": 1}
    return config | changes
