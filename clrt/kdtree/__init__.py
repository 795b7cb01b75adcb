"""kd-trees, one an object: `build_tree(vertices, builder="sah" | "median")`."""
