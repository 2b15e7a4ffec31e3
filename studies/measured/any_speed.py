"""Scenes of the radars at 24 GHz in which speed tells no class (`any_speed.yaml`), to lay over
their record.
"""

from pathlib import Path

from lowalt.files.yaml_files import load_yaml

ANY_SPEED = Path(__file__).with_name("any_speed.yaml")
RADAR = "cw_24ghz"


def any_speed() -> tuple[dict, dict]:
    """Return the keys of the block `twin` by radar, as `twin.records` takes them, and those of the
    recognition settings, as `twin_training.settings` does."""
    block = load_yaml(ANY_SPEED, "scenes at any speed")
    scenes = {
        label: [block["common"][label] | scene for scene in part]
        for label, part in block["scenes"].items()
    }
    return {
        RADAR: {"classes": block["classes"], "receiver": block["receiver"], "scenes": scenes}
    }, block["recognition"]
