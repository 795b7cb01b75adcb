"""`python -m clrt`, the same as `clrt`."""

from clrt.cli.entry import main

main()
