"""Built-in models: the step from a checked record to its cloud."""

import hashlib
import json

import numpy as np

from lowalt.config.classes import like
from lowalt.numerics.streams import stream
from lowalt.targets.assemble import assemble
from lowalt.targets.builtin_record import MODULES, check_record
from lowalt.targets.cloud import Cloud

__all__ = ["builtin_cloud", "check_record"]


def checksum(record: dict) -> str:
    """Return the SHA-256 of a record's canonical JSON (sorted keys, no spaces), 64 hexadecimal digits."""
    return hashlib.sha256(json.dumps(record, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def builtin_cloud(record: dict, seed: int) -> Cloud:
    """Return the cloud of a merged record whose source is `builtin`; equal record and seed give equal points.

    Raises: InputError where the record asks for fewer points than its parts need.
    """
    parts, facts = MODULES[like(record)].parts(record)
    full = record | facts | {"checksum": checksum(record), "seed": seed}
    cloud = assemble(parts, full, record["moving_share"], stream(seed, "cloud", record["subtype"]))
    assert np.isfinite(cloud.points).all()
    return cloud
