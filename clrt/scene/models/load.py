"""A model file of any kind that is read, by the extension of its name."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clrt import mesh
from clrt.scene.models import GLTF_EXTENSIONS, gltf
from clrt.scene.models.mesh_file import read_mesh_file
from clrt.scene.models.model_file import Model, ModelError
from clrt.scene.picture import Folders

EXTENSIONS = (*mesh.EXTENSIONS, *GLTF_EXTENSIONS)


def read_model(path: Path, allowed: Sequence[Path], *, materials: bool = True) -> Model:
    """What the file shows. Raises ModelError.

    allowed : folders, besides the file's own, that files it names may be in
    materials : whether the file's own are asked for; without, those of an OBJ are not looked for
    """
    extension, folders = path.suffix.lower(), Folders(path.parent, allowed)
    if extension not in EXTENSIONS:
        found = f"the extension {extension!r}" if extension else "no extension"
        raise ModelError(f"{found} is not one that is read; convert the mesh to one of {', '.join(EXTENSIONS)}")
    if extension not in GLTF_EXTENSIONS:
        return read_mesh_file(path, folders, materials)
    try:
        return gltf.read_gltf(path.read_bytes(), folders)
    except OSError as problem:
        raise ModelError(f"cannot be read: {problem.strerror or problem}") from None
