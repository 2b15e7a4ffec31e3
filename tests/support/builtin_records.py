"""The published table of targets, and the records of all built-in craft, birds and cars as written
and merged.
"""

from pathlib import Path

from lowalt.targets.records import load_table, merge, read_records

CONFIG = Path(__file__).parents[2] / "config"
TABLE = load_table(CONFIG / "targets.csv")
WRITTEN = {
    name: record
    for file in ("uav", "bird", "vehicle")
    for name, record in read_records(CONFIG / "targets" / f"{file}.yaml").items()
}
RECORDS = {name: merge(TABLE[name], record, name) for name, record in WRITTEN.items()}
UAVS, BIRDS, CARS = (
    [name for name, row in TABLE.items() if row["category"] == category]
    for category in ("UAV", "Bird", "Vehicle")
)
NAMES = [*UAVS, *BIRDS, *CARS]
