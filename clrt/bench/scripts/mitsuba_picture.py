"""The picture by Mitsuba 3, variant llvm_ad_rgb: its ray queries and a line of shading, compiled to one kernel for each pass."""

import json
import sys
from pathlib import Path

import drjit as dr
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")
folder, size = Path(sys.argv[1]), int(sys.argv[2])
view = json.loads((folder / "view.json").read_text())
scene = mi.load_dict({"type": "scene", "mesh": {"type": "ply", "filename": str(folder / "mesh.ply"), "face_normals": True}})

pixel = dr.arange(mi.UInt32, size * size)
u, v = (mi.Float(pixel % size) + 0.5) / size, (mi.Float(pixel // size) + 0.5) / size
corner, along_row, along_column = (mi.Vector3f(*view[name]) for name in ("corner", "along_row", "along_column"))
direction = dr.normalize(corner + u * along_row + v * along_column)
hit = scene.ray_intersect(mi.Ray3f(mi.Point3f(*view["eye"]), direction), mi.RayFlags.Minimal, True)

normal = dr.select(dr.dot(hit.n, direction) > 0, -hit.n, hit.n)
start = hit.p + view["offset"] * normal
to_light = mi.Point3f(*view["light"]) - start
cosine = dr.dot(normal, to_light) / dr.norm(to_light)
lit = hit.is_valid() & (cosine > 0)
shadow = mi.Ray3f(start, to_light)
shadow.maxt = mi.Float(1)
lit &= ~scene.ray_test(shadow, True, lit)

grey = dr.select(hit.is_valid(), 0.1 + dr.select(lit, 0.9 * cosine, 0), 0)
image = mi.TensorXf(grey, (size, size, 1))
mi.Bitmap(image).convert(mi.Bitmap.PixelFormat.Y, mi.Struct.Type.UInt8, srgb_gamma=False).write(sys.argv[3])
