"""The harness behind `make bench`: `python -m clrt.bench` measures, prints, and keeps the raw times as JSON.

    scenes.py, view.py      what is rendered: the report's scenes, or generated ones in their place; the view of the rays
    machine.py, warm.py     what it ran on; what is compiled before
    peers.py                the same rays for other tracers; embreex
    worker.py, workers/     peers in processes of their own; embree/driver.cpp is compiled where Embree is installed
    versus.py               rays a second against all peers; incoherent.py: of rays that go all ways
    ladder.py, measure.py, programs.py
                            rungs, trees against brute force, tests a ray, specialised programs
    commands.py, scripts/   whole commands from text to PNG, beside scripts for other programs; imports
    growth.py               curves against triangles, pixels and objects, of a process a point: growth_point.py
    marks.py                what was promised, and whether it was kept
    report.py, plots.py     results -> tables, on screen and as Markdown (tables_*.py); results -> plots
    export.py               results -> JSON; tables and plots -> the documentation

On its own feet: effects.py (docs/effects.md), forest.py (docs/kdtree.md), asm.py (`make asm`).
"""
