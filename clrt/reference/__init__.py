"""The independent references: a float64 tracer over all primitives, and an exact rational oracle.

They import `clrt.scene.model` and `clrt.errors` alone: what judges the kernels shares no code with them.
"""

from clrt.reference.tracer import ReferencePicture, render

__all__ = ["ReferencePicture", "render"]
