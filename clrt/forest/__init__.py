"""The kd-trees of a scene, all at once: by kernels on the device where that is sooner, else by NumPy (clrt/kdtree), the same trees.

choose.py       which of the two, and the way back from the device to NumPy
build.py        the kernels' way, as an outline
top.py          large nodes, level by level; pool.py: small ones, which subtrees.py builds in one piece each
layout.py       what they built as trees; machine.py: program and buffers; ticker.py: how far it has come
"""
