"""Pictures and their writers, one a file."""
