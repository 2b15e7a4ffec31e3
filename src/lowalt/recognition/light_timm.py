"""timm, imported without the compiler of torch, which takes seconds to import and which prediction never calls.

Fault: torchvision (`ops/roi_align.py`) and timm (`models/naflexvit.py`) import `torch._dynamo` for one function each.
Cure: while both are imported, stand-ins answer in its place. `is_compile_supported` imports the compiler when it is
called; `disable` returns the function as it is, so only a NaFlexViT under `torch.compile` is compiled differently.
"""

import sys
from types import ModuleType

import torch

__all__ = ["timm"]


def _is_compile_supported(device: str) -> bool:
    """Whether torch's compiler knows a kind of device."""
    from torch._dynamo.utils import is_compile_supported

    return is_compile_supported(device)


def _stand_ins() -> dict[str, ModuleType]:
    """The modules that answer in the place of the compiler's, by name; none where it is imported already."""
    names = ("torch._dynamo", "torch._dynamo.utils")
    if names[0] in sys.modules:
        return {}
    compiler, utils = map(ModuleType, names)
    compiler.disable = lambda function=None, *_arguments, **_named: function  # type: ignore[attr-defined]
    utils.is_compile_supported = _is_compile_supported  # type: ignore[attr-defined]
    return dict(zip(names, (compiler, utils), strict=True))


_absent = _stand_ins()
sys.modules.update(_absent)
try:
    import timm
    import timm.utils
finally:
    for _name in _absent:
        del sys.modules[_name]
    # An import binds a submodule to its package; the compiler's own import has to do that again.
    if _absent and "_dynamo" in vars(torch):
        del torch._dynamo
