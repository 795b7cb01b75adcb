"""`python -m clrt`, the same as `clrt`."""

from clrt.cli.main import main

main()
