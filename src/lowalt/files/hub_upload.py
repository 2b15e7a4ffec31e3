"""Uploading a folder to the Hugging Face hub in one commit, by the token that the environment holds."""

import argparse
import os
from pathlib import Path
from typing import Any

from lowalt.files.errors import InputError

TOKEN = "HF_TOKEN"
"""Environment variable with the token, which never stands on a command line."""


def add_options(options: argparse.ArgumentParser, kind: str) -> None:
    """Add the options of an upload of a kind ("dataset" or "model"): --repository and --public."""
    options.add_argument("--repository", required=True, metavar="USER/NAME", help=f"{kind} repository on the hub")
    options.add_argument("--public", action="store_true", help="make a new repository public (default: private)")


def client() -> Any:
    """Return a `huggingface_hub.HfApi` with the token of the environment.

    Raises: InputError where the token is not set or the package is missing.
    """
    token = os.environ.get(TOKEN)
    if not token:
        raise InputError(f"{TOKEN}: not set in the environment, expected a token with the right to write")
    try:
        from huggingface_hub import HfApi
    except ImportError as error:
        raise InputError(f"no package huggingface_hub ({error}), expected `pip install 'lowalt[sharing]'`") from error
    return HfApi(token=token)


def check_repository(repository: str) -> None:
    """Refuse the name of a repository that is not USER/NAME. Raises: InputError."""
    if repository.count("/") != 1 or not all(repository.split("/")):
        raise InputError(f"--repository: {repository!r}, expected USER/NAME")


def send(
    client: Any, repository: str, kind: str, folder: str | Path, names: list[str], message: str, private: bool
) -> None:
    """Create the repository where there is none, and upload the files `names` of a folder in one commit.

    client: a `huggingface_hub.HfApi` or an object with the same methods; kind: "dataset" or "model".
    """
    client.create_repo(repository, repo_type=kind, private=private, exist_ok=True)
    client.upload_folder(
        repo_id=repository, repo_type=kind, folder_path=str(folder), allow_patterns=names, commit_message=message
    )
