"""Models from files: glTF scenes, and the meshes of other formats, as parts that a scene is put together from."""
