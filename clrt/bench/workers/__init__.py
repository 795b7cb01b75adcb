"""Other tracers, each a process of its own that answers lines: `python -m clrt.bench.workers.NAME TRIANGLES THREADS`."""
