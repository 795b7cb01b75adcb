"""The harness behind `make bench`: `python -m clrt.bench` measures, prints, and keeps the raw times as JSON.

    scenes.py      what is rendered: the report's scenes, or generated ones in their place
    machine.py     what it ran on
    peers.py       the same rays through Embree
    measure.py     trees against brute force, tests a ray, whole commands, specialised programs
    versus.py      rays a second against the peer
    marks.py       what was promised, and whether it was kept
    report.py      results -> tables, on screen and as Markdown
    export.py      results -> JSON; tables -> the marked places of the documentation
"""
