"""Confirmed results of the baselines: each is frozen as a file that answers, with all that it
reads, and confirmed.

A frozen method and its result are kept in a folder, so that an interrupted call goes on where it
was.
"""

import json
import pickle
import shutil
from pathlib import Path

from methods import Trained

from lowalt.config.network import Network
from lowalt.extensions.benchmark.benchmark_tracks import Track
from lowalt.extensions.benchmark.confirm import Confirmed, confirm_predictions
from lowalt.extensions.benchmark.definition import MAIN, config_of
from lowalt.files.atomic import replacing
from lowalt.recognition.intervals import Interval

HERE = Path(__file__).parent
PREDICT = '''"""Answers of the baseline "{method}", for `lowalt benchmark confirm --predict`."""

import pickle
from pathlib import Path

{imports}

TRAINED_ON = "{track}", "train"
FILES = {files}

{body}
'''
PICKLED = """with Path(__file__).with_name("answer.pkl").open("rb") as file:
    answer = pickle.load(file)
seen = {seen}


def predict(signals, images):
    \"\"\"Probabilities (n, classes).\"\"\"
    return answer(seen(signals, images))"""
OF_NETWORK = """answer = network(Path(__file__).with_name("model.safetensors"), {backbone!r})


def predict(signals, images):
    \"\"\"Probabilities (n, classes).\"\"\"
    return answer(signals)"""


def _of_features(name: str) -> tuple[str, str]:
    """The imports of a method on features, and what it sees."""
    network = Network.from_settings(config_of(MAIN)["network"])
    frequencies_hz = tuple(station.frequency_hz for station in network.stations)
    imports = f"from features import {name}\nfrom seen import by_station"
    return imports, f"by_station({name}, {frequencies_hz!r}, {network.symbol_interval_s!r})"


def frozen(
    method: str, track: Track, trained: Trained, training: Path, kept: Path, folder: Path
) -> Path:
    """Write a trained method as a file that answers, with all that it reads; return the file.

    training: the folder of the training's files; kept: that of what methods see; folder: where to
    write.
    """
    sources = {HERE / "seen.py", HERE / "classical.py"}
    body = PICKLED
    if trained.sees == "signals":
        backbone = "complex" if method.startswith("complex") else method.split()[0].lower()
        sources = {HERE / "seen.py", HERE / "signal_networks.py", training / "model.safetensors"}
        imports = "from seen import network"
        body = OF_NETWORK.format(backbone=backbone)
    elif trained.sees == "nothing":
        imports = ""
        body = PICKLED.format(seen="lambda signals, images: len(signals)")
    elif trained.sees == "embedded":
        weights = next(kept.glob("*.pth"))
        sources |= {HERE / "frozen.py", HERE.parent / "imagenet_weights.py", weights}
        colours = config_of(MAIN)["images"]["colour_map"]
        imports = "from seen import embedding"
        body = PICKLED.format(
            seen=f"embedding(Path(__file__).with_name({weights.name!r}), {colours!r})"
        )
    else:
        name = {"moments": "spectral_moments", "features": "features"}[trained.sees]
        sources |= {HERE / "features.py"}
        imports, seen = _of_features(name)
        body = PICKLED.format(seen=seen)
    folder.mkdir(parents=True, exist_ok=True)
    files = sorted(source.name for source in sources)
    for source in sources:
        shutil.copy(source, folder / source.name)
    if trained.sees != "signals":
        files.append("answer.pkl")
        (folder / "answer.pkl").write_bytes(pickle.dumps(trained.answer))
    text = PREDICT.format(method=method, track=track.name, imports=imports, files=files, body=body)
    (folder / "predict.py").write_text(text)
    return folder / "predict.py"


def kept_result(folder: Path) -> Confirmed | None:
    """Return the confirmed result that a folder keeps, None where it has none yet."""
    path = folder / "confirmed.json"
    if not path.is_file():
        return None
    content = json.loads(path.read_text())
    return Confirmed(**{**content, "percent": Interval(*content["percent"])})


def keep(found: Confirmed, folder: Path) -> None:
    """Keep a confirmed result in a folder."""
    with replacing(folder / "confirmed.json") as temporary:
        temporary.write_text(json.dumps(found._asdict(), indent=1) + "\n")


def result(folder: Path, track: Track) -> Confirmed:
    """Return the confirmed result of a frozen method in a folder, and keep it there."""
    found = confirm_predictions(folder / "predict.py", track)
    keep(found, folder)
    return found
