"""Publishing a trained model on the Hugging Face hub: a model file and its card.

`python -m lowalt.recognition.upload --model FILE.safetensors --repository USER/NAME`. The token is read from the
environment (HF_TOKEN), never from the command line. The file is read and checked first: a damaged one is not published.
"""

import argparse
import shutil
import tempfile
from pathlib import Path
from typing import Any

from lowalt.config.command import name_backbone, run
from lowalt.files import hub_upload
from lowalt.files.atomic import existing
from lowalt.recognition import model_file

NAMES = {"model": "model.safetensors", "card": "README.md"}
"""Names of the two files in the repository; the hub shows its README.md as the card."""


def upload(model: str | Path, repository: str, client: Any, private: bool = True, trusted: str = "") -> str:
    """Create the repository where there is none, upload model and card in one commit, return the commit's message.

    model: a .safetensors file, its card (.md) next to it; client: a `huggingface_hub.HfApi` with its token, or an
    object with the same methods; trusted: as in `runs.of_state`.
    Raises: InputError where the file is damaged, has no card, or the repository's name is not USER/NAME.
    """
    hub_upload.check_repository(repository)
    content = model_file.read(model)
    model_file.trained(content, model, trusted)
    card = existing(Path(model).with_suffix(".md"), "model card")
    message = f"{content.model['scheme']['name']}, {content.model['protocol']}, seed {content.model['seed']}"
    with tempfile.TemporaryDirectory() as folder:
        shutil.copyfile(model, Path(folder, NAMES["model"]))
        shutil.copyfile(card, Path(folder, NAMES["card"]))
        hub_upload.send(client, repository, "model", folder, list(NAMES.values()), message, private)
    return message


def main(arguments: list[str]) -> None:
    """Check a model file and upload it with its card, by the token in HF_TOKEN."""
    options = argparse.ArgumentParser(prog="python -m lowalt.recognition.upload", description=main.__doc__)
    options.add_argument("--model", required=True, help="model file (.safetensors), its card (.md) next to it")
    hub_upload.add_options(options, "model")
    name_backbone(options)
    chosen = options.parse_args(arguments)
    message = upload(chosen.model, chosen.repository, hub_upload.client(), not chosen.public, chosen.backbone)
    print(f"{chosen.repository}: {message}")


if __name__ == "__main__":
    run(main)
