"""What accuracy costs in time: measured into study.json, shown as study.md and study.html."""
