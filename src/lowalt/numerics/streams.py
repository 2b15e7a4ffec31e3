"""Random streams: an independent generator for each named purpose.

A stream is keyed by its purpose (random seed, name, subtype, model, ...) and not by a position in a
list. Adding a subtype, an SNR or an effect therefore changes no other stream, and results do not
depend on shards, jobs or workers.
"""

import hashlib

import numpy as np

from lowalt.numerics.draws import Draws

Key = str | int | float


def digest(seed: int, purpose: str, *keys: Key) -> bytes:
    """Return the 32-byte SHA-256 digest that identifies one stream.

    Each key is written with its type and length, so ("a", "bc") and ("ab", "c"), or 3 and "3",
    differ; an integral float equals its integer (an SNR of 3 and of 3.0 are the same stream).

    Raises: TypeError for a key that is no str, int or float.
    """
    parts = []
    for key in (seed, purpose, *keys):
        if isinstance(key, str):
            text = "s" + key
        elif isinstance(key, (int, np.integer)) and not isinstance(key, bool):
            text = f"i{int(key)}"
        elif isinstance(key, (float, np.floating)):
            text = f"i{int(key)}" if float(key).is_integer() else f"f{float(key)!r}"
        else:
            raise TypeError(
                f"stream key {key!r} is {type(key).__name__}, expected str, int or float"
            )
        raw = text.encode()
        parts.append(len(raw).to_bytes(4, "little") + raw)
    return hashlib.sha256(b"".join(parts)).digest()


def stream(seed: int, purpose: str, *keys: Key) -> Draws:
    """Return the generator of the stream (seed, purpose, *keys).

    It is NumPy's PCG64 seeded by SHA-256, read by `Draws`.

    Raises: TypeError for a key that is no str, int or float.
    Source: NumPy's SeedSequence takes entropy of any size; with 256 bits, two equal streams do not
    occur.
    """
    words = np.frombuffer(digest(seed, purpose, *keys), "<u4")
    # SeedSequence splits an integer into words without leading zeros. Passing these words saves a
    # third of its time.
    entropy: np.ndarray | int = words.astype(np.uint32)
    if words[-1] == 0:
        entropy = int.from_bytes(words.tobytes(), "little")
    return Draws(np.random.PCG64(np.random.SeedSequence(entropy)))
