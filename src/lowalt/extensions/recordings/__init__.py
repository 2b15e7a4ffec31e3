"""Recordings: measured baseband as signals at a radar's symbol rate, and the twin that simulates the same radar."""

from lowalt.extensions.recordings.channel import SAMPLINGS, coherent_intervals, symbol_rate
from lowalt.extensions.recordings.files import read
from lowalt.extensions.recordings.record import Record, read_record

__all__ = ["SAMPLINGS", "Record", "coherent_intervals", "read", "read_record", "symbol_rate"]
