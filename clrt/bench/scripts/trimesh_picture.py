"""The picture by trimesh, which traces with Embree where embreex is installed."""

import json
import sys
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

folder, size = Path(sys.argv[1]), int(sys.argv[2])
view = {name: np.array(value) for name, value in json.loads((folder / "view.json").read_text()).items()}
mesh = trimesh.load(folder / "mesh.ply", process=False)

middles = (np.arange(size) + 0.5) / size
directions = view["corner"] + middles[None, :, None] * view["along_row"] + middles[:, None, None] * view["along_column"]
directions = (directions / np.linalg.norm(directions, axis=-1, keepdims=True)).reshape(-1, 3)
points, ray, triangle = mesh.ray.intersects_location(np.broadcast_to(view["eye"], directions.shape), directions, multiple_hits=False)

normals = mesh.face_normals[triangle]
normals = normals * -np.sign(np.einsum("ij,ij->i", normals, directions[ray]))[:, None]
to_light = view["light"] - points
cosine = np.einsum("ij,ij->i", normals, to_light) / np.linalg.norm(to_light, axis=1)
lit = cosine > 0
lit[lit] = ~mesh.ray.intersects_any(points[lit] + view["offset"] * normals[lit], to_light[lit])

grey = np.zeros(size * size)
grey[ray] = 0.1 + 0.9 * cosine * lit
Image.fromarray(np.round(255 * grey.clip(0, 1)).astype(np.uint8).reshape(size, size)).save(sys.argv[3])
