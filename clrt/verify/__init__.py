"""The catalogue of hard cases: rays, triangles and spheres on which ray tracers are known to fail, each with its oracle.

`clrt verify` runs it on the user's device, tests/test_verify.py under pytest; both through `clrt.verify.run`.
"""
