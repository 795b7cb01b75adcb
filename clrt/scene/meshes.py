"""What the word `mesh` adds to a scene; the files are read by mesh_lines.py, which only scenes with that word import."""

from __future__ import annotations

from dataclasses import dataclass, field

from clrt.scene.model import Instance, Material, MeshObject, Texture


@dataclass(eq=False)
class Meshes:
    """What the mesh lines of a text add, behind what it has itself: triangles behind its T lines, and so on.

    named : line -> index of the object that the line gives a name
    """

    objects: list[MeshObject] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    materials: list[Material] = field(default_factory=list)
    textures: list[Texture] = field(default_factory=list)
    named: dict[int, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
