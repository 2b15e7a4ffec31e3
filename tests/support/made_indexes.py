"""Indexes of one shard that is not there, sealed with the checksum of what they say."""

import json
from pathlib import Path

from lowalt.files.yaml_files import load_yaml
from lowalt.shards import index


def index_of(folder: Path, **changes: object) -> Path:
    """Write an index of one shard, some of whose facts are changed."""
    entry = {"name": "a", "path": "a.tar", "group": "seen", "fold": "train", "samples": 1}
    entry |= {"bytes": 1, "table_sha256": "0" * 64, **changes}
    render = {
        name: load_yaml("config/default.yaml")[name] for name in ("network", "spectra", "images")
    }
    content = {"format": index.FORMAT, "kind": "image", "shards": [entry], "render": render}
    content["sha256"] = index._checksum(content)
    (folder / "index.json").write_text(json.dumps(content))
    return folder / "index.json"
