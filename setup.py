"""What `pyproject.toml` cannot say: a wheel carries the workflow, so that `lowalt run` works
without a checkout.
"""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

SHIPPED = (
    "Snakefile",
    "workflow",
    "config",
    "profiles",
    "envs",
    "results/reference",
    "results/zoo",
)


class BuildWithWorkflow(build_py):
    """Copies the workflow into the built package; an editable installation finds it in the
    checkout.
    """

    def run(self) -> None:
        """Build the package, then add the workflow's files to it."""
        super().run()
        if self.editable_mode:
            return
        for name in SHIPPED:
            target = Path(self.build_lib) / "lowalt/shipped" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if Path(name).is_dir():
                shutil.copytree(name, target, dirs_exist_ok=True)
            else:
                shutil.copy(name, target)


setup(cmdclass={"build_py": BuildWithWorkflow})
