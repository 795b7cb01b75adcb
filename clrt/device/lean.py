"""Programs without the header of OpenCL, for PoCL, which reads it twice for every program, even for one that its cache has.

The header declares 15,000 functions, of which kernels use some 30: `builtins.cl` has those. PoCL takes the header for read where the macro
that guards it is defined; types and constants have another. A program that needs more does not compile so, and is compiled
with the header.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

BUILTINS = "builtins.cl"
OPTIONS = ("-D_OPENCL_H_",)
_AGAIN = "\n// built again, past the cache\n"


def attempts(folder: Path, source: str, *, pocl: bool) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What to compile for `source`, and the options that it takes besides, until one is compiled; `folder` holds the kernel files.

    The last is a text that no cache knows: an entry of PoCL's cache may be broken.
    """
    if pocl:
        yield f'{(folder / BUILTINS).read_text(encoding="utf-8")}#line 1 "program"\n{source}', OPTIONS
    yield source, ()
    yield source + _AGAIN, ()


def lacks(error: Exception) -> bool:
    """Whether a program did not compile without the header for what is written in it, and not for a broken entry of a cache."""
    return "error:" in str(error)
