"""Accuracy on request: replicates tell the error, and tiles are sampled where that error is. docs/error.md."""
