"""The same picture by other programs, as one would write it for them: `python NAME.py FOLDER SIZE PICTURE`, nothing of clrt in it.

The folder has mesh.ply and view.json: eye, image plane (corner, along_row, along_column from the eye), light, all right-handed.
Grey: 0.1, and 0.9 times the cosine to the light where it is seen; black where nothing is hit.
"""
