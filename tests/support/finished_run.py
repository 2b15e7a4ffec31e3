"""The folder of a finished run around a training: a table of accuracy and a configuration."""

import shutil
from pathlib import Path

import numpy as np
import torch
import yaml

from pictures import IMAGES, NETWORK, SPECTRA
from trainings import sources

TABLE = """\
protocol,scheme,snr_db,accuracy_percent,samples,hardware,seeds,spread_points
seen,AB:VRP+VT,3,81.2500,16,a machine,3,0.5
seen,AB:VRP+VT,avg,84.3750,32,a machine,3,0.5
unseen,AB:VRP+VT,avg,11.1111,32,a machine,3,0.5
"""


def finished_run(trained: Path, folder: Path) -> Path:
    """Put a training into the folder of a run; returns its model.safetensors."""
    place = folder / "results/mine/models/seen/ab-vrp-vt/3"
    shutil.copytree(trained, place)
    config = {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES, "split": {}}
    (folder / "results/mine/config.yaml").write_text(yaml.safe_dump(config))
    (folder / "results/mine/accuracy.csv").write_text(TABLE)
    return place / "model.safetensors"


def answers(trained, views):
    """Class probabilities of a model for the validation samples."""
    with torch.inference_mode():
        return trained.model(
            torch.from_numpy(sources(views)["validation"].views(np.arange(12)))
        ).softmax(1)
