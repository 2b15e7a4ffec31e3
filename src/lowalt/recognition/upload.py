"""Publishing a trained model on the Hugging Face hub: a model file and its card.

`python -m lowalt.recognition.upload --model FILE.safetensors --repository USER/NAME`. The token is read from the
environment (HF_TOKEN), never from the command line. The file is read and checked first: a damaged one is not published.
"""

import argparse
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

from lowalt.common.command import run
from lowalt.common.errors import InputError
from lowalt.common.files import existing
from lowalt.recognition import model_file

TOKEN = "HF_TOKEN"
NAMES = {"model": "model.safetensors", "card": "README.md"}
"""Names of the two files in the repository; the hub shows its README.md as the card."""


def upload(model: str | Path, repository: str, client: Any, private: bool = True) -> str:
    """Create the repository where there is none, upload model and card in one commit, return the commit's message.

    model: a .safetensors file, its card (.md) next to it; client: a `huggingface_hub.HfApi` with its token, or an
    object with the same methods.
    Raises: InputError where the file is damaged, has no card, or the repository's name is not USER/NAME.
    """
    if repository.count("/") != 1 or not all(repository.split("/")):
        raise InputError(f"--repository: {repository!r}, expected USER/NAME")
    content = model_file.read(model)
    model_file.trained(content, model)
    card = existing(Path(model).with_suffix(".md"), "model card")
    message = f"{content.model['scheme']['name']}, {content.model['protocol']}, seed {content.model['seed']}"
    with tempfile.TemporaryDirectory() as folder:
        shutil.copyfile(model, Path(folder, NAMES["model"]))
        shutil.copyfile(card, Path(folder, NAMES["card"]))
        client.create_repo(repository, repo_type="model", private=private, exist_ok=True)
        client.upload_folder(
            repo_id=repository, repo_type="model", folder_path=folder, allow_patterns=list(NAMES.values()),
            commit_message=message,
        )  # fmt: skip
    return message


def main(arguments: list[str]) -> None:
    """Check a model file and upload it with its card, by the token in HF_TOKEN."""
    options = argparse.ArgumentParser(prog="python -m lowalt.recognition.upload", description=main.__doc__)
    options.add_argument("--model", required=True, help="model file (.safetensors), its card (.md) next to it")
    options.add_argument("--repository", required=True, metavar="USER/NAME", help="model repository on the hub")
    options.add_argument("--public", action="store_true", help="make a new repository public (default: private)")
    given = options.parse_args(arguments)
    token = os.environ.get(TOKEN)
    if not token:
        raise InputError(f"{TOKEN}: not set in the environment, expected a token with the right to write")
    try:
        from huggingface_hub import HfApi
    except ImportError as error:
        raise InputError(f"no package huggingface_hub ({error}), expected `pip install 'lowalt[sharing]'`") from error
    print(f"{given.repository}: {upload(given.model, given.repository, HfApi(token=token), private=not given.public)}")


if __name__ == "__main__":
    run(main)
