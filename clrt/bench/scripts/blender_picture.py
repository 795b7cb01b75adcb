"""The picture by Blender: Cycles on the processor, a sample in the middle of each pixel. Runs as `blender -b --python FILE -- ...`, too."""

import json
import sys
from pathlib import Path

import bpy
from mathutils import Matrix, Vector

folder, size, picture = sys.argv[-3], int(sys.argv[-2]), sys.argv[-1]
view = {name: value for name, value in json.loads(Path(folder, "view.json").read_text()).items() if name != "offset"}
eye, corner, along_row, along_column, light = (Vector(view[n]) for n in ("eye", "corner", "along_row", "along_column", "light"))

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.ply_import(filepath=str(Path(folder, "mesh.ply")), forward_axis="Y", up_axis="Z")
mesh = bpy.context.object

material = bpy.data.materials.new("matt")
material.use_nodes = True
nodes, links = material.node_tree.nodes, material.node_tree.links
nodes.clear()
matt, glow, both, out = (nodes.new(f"ShaderNode{kind}") for kind in ("BsdfDiffuse", "Emission", "AddShader", "OutputMaterial"))
matt.inputs["Color"].default_value = (0.9, 0.9, 0.9, 1)
glow.inputs["Color"].default_value = (0.1, 0.1, 0.1, 1)
links.new(matt.outputs[0], both.inputs[0])
links.new(glow.outputs[0], both.inputs[1])
links.new(nodes.new("ShaderNodeLightPath").outputs["Is Camera Ray"], glow.inputs["Strength"])  # it lights nothing else
links.new(both.outputs[0], out.inputs["Surface"])
mesh.data.materials.clear()
mesh.data.materials.append(material)

lamp = bpy.data.lights.new("lamp", "POINT")
lamp.shadow_soft_size = 0
lamp.energy = 1
lamp.use_nodes = True
falloff = lamp.node_tree.nodes.new("ShaderNodeLightFalloff")
falloff.inputs["Strength"].default_value = 39.4784176  # 4 pi^2: the strength of a lamp whose light has the irradiance pi at every distance
lamp.node_tree.links.new(falloff.outputs["Constant"], lamp.node_tree.nodes["Emission"].inputs["Strength"])
lamp_object = bpy.data.objects.new("lamp", lamp)
lamp_object.location = light

camera = bpy.data.cameras.new("camera")
ahead = (corner + (along_row + along_column) / 2).normalized()
right = along_row.normalized()
camera.angle = 2 * (corner + along_column / 2).angle(ahead)
camera_object = bpy.data.objects.new("camera", camera)
camera_object.matrix_world = Matrix.Translation(eye) @ Matrix((right, right.cross(ahead), -ahead)).transposed().to_4x4()
camera.clip_end = 1e6
scene = bpy.context.scene
for thing in (lamp_object, camera_object):
    scene.collection.objects.link(thing)
scene.camera = camera_object

scene.render.engine = "CYCLES"
scene.cycles.samples = 1
scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 0.01
scene.cycles.max_bounces = 0
scene.world = None
scene.view_settings.view_transform = "Raw"
scene.render.resolution_x = scene.render.resolution_y = size
scene.render.image_settings.file_format, scene.render.image_settings.color_mode = "PNG", "BW"
scene.render.dither_intensity = 0
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)
