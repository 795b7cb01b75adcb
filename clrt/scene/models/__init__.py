"""Models from files: glTF scenes, and the meshes of other formats, as parts that a scene is put together from.

Their modules are imported by the first scene that names such a file.
"""

from __future__ import annotations

from pathlib import Path

GLTF_EXTENSIONS = (".gltf", ".glb")


def is_model(path: Path) -> bool:
    """Whether a file of that name is a scene by itself."""
    return path.suffix.lower() in GLTF_EXTENSIONS
