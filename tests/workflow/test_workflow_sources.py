"""Source files of a stage: an import counts wherever it stands, except in the functions of a
command.
"""

import pytest

from lowalt.workflow import sources

LINES = """
import lowalt.files.errors
if True:
    from lowalt.files import slug_is_none, atomic
elif False:
    import os, lowalt.config.blocks
else:
    from lowalt.numerics.streams import stream
for _ in ():
    import lowalt.config.splits
else:
    import lowalt.machine.hardware
try:
    import lowalt.config.network
except ImportError:
    import lowalt.config.classes
else:
    import lowalt.machine.timing
finally:
    import lowalt.machine.memory
with open("x"):
    import lowalt.config.layers
match 1:
    case 1:
        import lowalt.machine.progress
class Held:
    def method(self):
        while True:
            import lowalt.files.shipped
async def later():
    import lowalt.numerics.portable
from . import nothing
import lowalt_other.common, numpy
"""
FOUND = {
    "files": ["errors", "atomic", "shipped"],
    "numerics": ["streams", "portable"],
    "machine": ["hardware", "timing", "memory", "progress"],
    "config": ["blocks", "splits", "network", "classes", "layers"],
}


def test_imports_count_in_every_kind_of_block_and_in_a_command_only_at_its_top(tmp_path):
    for name in ("module.py", "__main__.py"):
        (tmp_path / name).write_text(LINES)
    found = [name for name in sources._imports(tmp_path / "module.py") if name.count(".") == 2]
    assert sorted(found) == sorted(
        f"lowalt.{room}.{name}" for room, names in FOUND.items() for name in names
    )
    assert [
        name for name in sources._imports(tmp_path / "__main__.py") if name.count(".") == 2
    ] == ["lowalt.files.errors"]


def test_files_of_a_module_are_its_own_its_packages_and_all_they_import_sorted():
    found = sources.sources("lowalt.noise")
    names = [str(path.relative_to(sources.ROOT)) for path in found]
    own = {
        f"lowalt/{name}.py"
        for name in ("__init__", "noise/__init__", "noise/__main__", "noise/awgn")
    }
    assert names == sorted(set(names)) and own | {"lowalt/numerics/streams.py"} <= set(names)
    assert not [
        name for name in names if name.startswith(("lowalt/recognition/", "lowalt/workflow/"))
    ]
    with pytest.raises(ModuleNotFoundError, match=r"lowalt\.none"):
        sources.sources("lowalt.none")
    catalogue = sources.sources("lowalt.spectra.catalogue", spectra=("vt",))
    kinds = {path.stem for path in catalogue if path.parent.name == "kinds"}
    assert "vt" in kinds and "trp" not in kinds


def test_a_path_below_the_working_directory_is_named_from_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert sources.near(tmp_path / "a/b.py") == "a/b.py"
    assert sources.near(tmp_path.parent / "b.py") == str(tmp_path.parent / "b.py")
