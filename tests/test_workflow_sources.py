"""Source files of a stage: an import counts wherever it stands, except in the functions of a command."""

import pytest

from lowalt.workflow import sources

LINES = '''
import lowalt.common.errors
if True:
    from lowalt.common import slug_is_none, files
elif False:
    import os, lowalt.common.plan
else:
    from lowalt.common.streams import stream
for _ in ():
    import lowalt.common.splits
else:
    import lowalt.common.turns
try:
    import lowalt.common.network
except ImportError:
    import lowalt.common.classes
else:
    import lowalt.common.timing
finally:
    import lowalt.common.memory
with open("x"):
    import lowalt.common.config
match 1:
    case 1:
        import lowalt.common.progress
class Held:
    def method(self):
        while True:
            import lowalt.common.shipped
async def later():
    import lowalt.common.portable
from . import nothing
import lowalt_other.common, numpy
'''  # fmt: skip
FOUND = ["errors", "files", "plan", "streams", "splits", "turns", "network", "classes", "timing", "memory", "config",
         "progress", "shipped", "portable"]  # fmt: skip


def test_imports_count_in_every_kind_of_block_and_in_a_command_only_at_its_top(tmp_path):
    for name in ("module.py", "__main__.py"):
        (tmp_path / name).write_text(LINES)
    found = [name for name in sources._imports(tmp_path / "module.py") if name != "lowalt.common"]
    assert sorted(found) == sorted(f"lowalt.common.{name}" for name in FOUND)
    assert [name for name in sources._imports(tmp_path / "__main__.py") if name != "lowalt.common"] == [
        "lowalt.common.errors"
    ]


def test_files_of_a_module_are_its_own_its_packages_and_all_they_import_sorted():
    found = sources.sources("lowalt.noise")
    names = [str(path.relative_to(sources.ROOT)) for path in found]
    own = {f"lowalt/{name}.py" for name in ("__init__", "noise/__init__", "noise/__main__", "noise/awgn")}
    assert names == sorted(set(names)) and own | {"lowalt/common/streams.py"} <= set(names)
    assert not [name for name in names if name.startswith(("lowalt/recognition/", "lowalt/workflow/"))]
    with pytest.raises(ModuleNotFoundError, match=r"lowalt\.none"):
        sources.sources("lowalt.none")
    catalogue = sources.sources("lowalt.spectra.catalogue", spectra=("vt",))
    kinds = {path.stem for path in catalogue if path.parent.name == "kinds"}
    assert "vt" in kinds and "trp" not in kinds


def test_a_path_below_the_working_directory_is_named_from_there(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert sources.near(tmp_path / "a/b.py") == "a/b.py"
    assert sources.near(tmp_path.parent / "b.py") == str(tmp_path.parent / "b.py")
