"""What a measurement ran on: without it, a time means nothing."""

from __future__ import annotations

import platform
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

from clrt import __version__
from clrt.device.context import DeviceInfo
from clrt.machine import cores, cpu_model, load_average, memory_gib, now

__all__ = ["cores", "cpu_model", "describe", "load_average", "now"]


def describe(device: DeviceInfo) -> dict[str, Any]:
    """Processor, memory, operating system, OpenCL and versions, JSON types; None for what cannot be found out."""
    return {
        "cpu": cpu_model(),
        "cores": cores(),
        "memory_gib": memory_gib(),
        "os": platform.platform(),
        "python": platform.python_version(),
        "opencl_device": device.name,
        "opencl_platform": device.platform,
        "opencl_version": device.version,
        "opencl_driver": device.driver,
        "lanes": device.lanes,
        "packages": {name: _version(name) for name in ("numpy", "pyopencl", "embreex", "trimesh", "mitsuba", "open3d", "bpy")},
        "clrt": __version__,
        "commit": _commit(),
    }


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _commit() -> str | None:
    """The checkout's commit, with a plus sign where its files have been changed since; None without git or a checkout."""
    folder = Path(__file__).resolve().parents[2]
    if not (folder / "pyproject.toml").is_file():
        return None
    try:
        head, changed = (
            subprocess.run(["git", *command], cwd=folder, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
            for command in (["rev-parse", "--short", "HEAD"], ["status", "--porcelain", "--untracked-files=no"])
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return head + ("+" if changed else "")
