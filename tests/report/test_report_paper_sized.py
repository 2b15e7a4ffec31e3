"""A page with tables of the paper's size: every published scheme in both protocols, 40 subtypes, 6
SNRs, 5 seeds.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.report.inputs import FILES, Inputs
from lowalt.report.page import assembled, rendered
from lowalt.report.sections import accuracy, comparisons, confusion, subtypes
from lowalt.targets.records import load_table
from pages import sound

pytestmark = pytest.mark.slow
PUBLISHED = "config/published_accuracy.csv"
CLASSES = ("UAV", "Bird", "Vehicle", "Pedestrian")
SECTIONS = {
    "accuracy": accuracy,
    "comparisons": comparisons,
    "confusion": confusion,
    "subtypes": subtypes,
}


def tables():
    """Rows of every table of recognition for all published schemes; figures are drawn, not
    measured.
    """
    rng = np.random.default_rng(3)
    targets = [
        {"subtype": name, "category": row["category"]}
        for name, row in load_table("config/targets.csv").items()
    ]
    pairs = list(dict.fromkeys((row["protocol"], row["scheme"]) for row in read_csv(PUBLISHED)))
    some = {"accuracy_percent": 90.0, "samples": 400}
    names = [{"protocol": protocol, "scheme": scheme} for protocol, scheme in pairs]
    snrs = ["3", "8", "13", "18", "23", "inf", "avg"]
    trained = {
        "backbone": "swin_base_patch4_window7_224",
        "weights": "hub",
        "parameters": 9e7,
        "steps": 1e5,
        "train_s": 1,
        "train_processor_s": 1,
        "samples_per_s": 1,
        "precision": "bf16",
        "ranks": 1,
        "hardware": "x",
    }
    one = {
        **names[0],
        "over": names[1]["scheme"],
        "difference_points": 1,
        "low": 0,
        "high": 2,
        "resampled": "all",
        "seeds": 5,
        "claim": "c",
        "paper_points": 1,
        "ordering": "holds",
    }
    several = {
        "seeds": 5,
        "spread_points": 0.3,
        "macro_f1_percent": 90,
        "macro_f1_low": 80,
        "macro_f1_high": 95,
    }
    return {
        "accuracy": [
            {**name, **several, "snr_db": snr, "accuracy_percent": rng.uniform(50, 100)}
            for name in names
            for snr in snrs
        ],
        "confusion_by_snr": [
            {
                **name,
                "snr_db": snr,
                "category": true,
                "predicted": other,
                "samples": rng.integers(999),
            }
            for name in names
            for snr in snrs[:-1]
            for true in CLASSES
            for other in CLASSES
        ],
        "subtypes": [
            {**name, **some, **row, "accuracy_percent": rng.uniform(20, 100)}
            for name in names
            for row in targets
        ],
        "comparisons": [one] * len(names),
        "orderings": [one] * len(names),
        "seeds": [
            {**name, **trained, "seed": seed, "accuracy_percent": 90.0}
            for name in names
            for seed in range(5)
        ],
        "distances": [
            {**row, "nearest_trained": "Crow", "trained_distance": 0.1, "trained_size_ratio": 1.0}
            for row in targets
        ],
    }


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    files = dict.fromkeys(FILES, "none.csv")
    for name, rows in tables().items():
        files[name] = str(folder / f"{name}.csv")
        write_csv(files[name], list(rows[0]), rows)
    run = SimpleNamespace(
        inputs=Inputs({**files, "published": PUBLISHED, "clouds": [], "benchmarks": []}),
        config=load_yaml("config/default.yaml"),
        shards=SimpleNamespace(classes=CLASSES),
        snr_labels=["3", "8", "13", "18", "23", "inf"],
    )
    return assembled(
        "paper",
        [
            {"id": name, "title": name, "html": rendered(name, section.values(run))}
            for name, section in SECTIONS.items()
        ],
    )


def test_a_page_of_the_paper_s_tables_is_whole_and_light(page):
    found = {table["caption"]: table for table in sound(page).tables}
    assert len(found["Accuracy of each subtype, percent"]["rows"]) == 40
    assert sum(len(table["rows"]) for table in found.values()) > 100
    assert len(page.encode()) < 8e6
