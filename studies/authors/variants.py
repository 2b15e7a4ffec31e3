"""Which change of a target's geometry moves its recognition: `python variants.py RUN OUT.csv`.

RUN is a finished run whose networks were trained on the other subtypes (protocol unseen, three stations). Each variant
changes one figure of a record back, and the run's networks are asked about 40 new motion models of it at 13 dB.
"""

import copy
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml

from lowalt.config.layers import load
from lowalt.files.csv_tables import write_csv
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition.one_sample import answer
from lowalt.recognition.runs import load as load_model
from lowalt.shards.dataset import Dataset
from lowalt.tiles import split

ROOT = Path(__file__).parents[2]
EH, SPARROW = "EH 216 S", "Sparrow"
VARIANTS = (
    (EH, "as the authors show it", {}),
    (EH, "40 % of the points on rotors", {"moving_share": 0.4}),
    (EH, "blades of 0.7 m", {"propeller_diameter": 1.42}),
    (EH, "the maker's cabin", {"body_length": 2.6, "body_width": 1.6, "body_height": 1.55}),
    (EH, "the maker's hubs and blades", {"motor_diagonal": 3.85, "propeller_diameter": 1.42}),
    (SPARROW, "as the authors show it", {}),
    (SPARROW, "62 % of the points on wings", {"moving_share": 0.62}),
    (SPARROW, "the former wing beat", {"flap": {"mean_deg": 15, "amplitude_deg": 40}}),
    (SPARROW, "the living bird's span", {"span": 0.237}),
)
"""Subtype, what is changed, and the keys of its record that are changed."""
MODELS, SNR_DB = 40, 13.0


def changed(subtype: str, changes: dict) -> dict:
    """Return the record of a subtype with some of its keys or figures changed."""
    file = "uav.yaml" if subtype == EH else "bird.yaml"
    record = copy.deepcopy(load_yaml(ROOT / "config/targets" / file)[subtype])
    for key, value in changes.items():
        if key in record["figures"]:
            record["figures"][key][0] = value
        else:
            record[key] = value
    return {subtype: record}


def main(run: Path, out: Path) -> None:
    """Ask the run's networks about every variant and write the shares of their answers."""
    networks = [load_model(path) for path in sorted(run.glob("models/unseen/abc-vrp-trp-vt/*/model.pt"))]
    rows = []
    for subtype, words, changes in VARIANTS:
        config = load([ROOT / "config/default.yaml"], ROOT / "workflow/schemas/config.schema.yaml")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "variant.yaml"
            path.write_text(yaml.safe_dump(changed(subtype, changes)))
            config["targets"] |= {"records": [*config["targets"]["records"], str(path)], "select": [subtype]}
            config["motion"] |= {"models": MODELS, "models_per_chunk": MODELS}
            config["noise"]["snr_db"] = [SNR_DB]
            samples = Dataset(config)
            told = np.zeros(len(samples.classes))
            for number in range(len(samples)):
                images = split(samples[number][0], len(config["spectra"]))
                for network in networks:
                    said = answer(network, images, config, subtype)
                    told[list(said).index(max(said, key=said.__getitem__))] += 1
        shares = {name: f"{100 * count / told.sum():.0f}" for name, count in zip(samples.classes, told, strict=True)}
        rows.append({"subtype": subtype, "variant": words, **shares})
        print(rows[-1], file=sys.stderr)
    write_csv(out, list(rows[0]), rows)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
