"""The scene a node was started for, as the program that started it reads it."""

from __future__ import annotations

import json
import os
import subprocess
from typing import Any

FORMAT = "stagger-check/3"


def read(environment: os._Environ[str] | dict[str, str] = os.environ) -> dict[str, Any]:
    """What `stagger check --json` says about the scene of the environment (docs/check.md)."""
    path = environment.get("STAGGER_SCENE")
    if not path:
        raise RuntimeError("STAGGER_SCENE is not set: expected the path of the scene; `stagger run --node` sets it")
    # On another host, where nothing is set up by the launcher, the program is on the PATH.
    command = [environment.get("STAGGER_PROGRAM", "stagger"), "check", "--json"]
    command += [f"--set={key}={value}" for key, value in json.loads(environment.get("STAGGER_OVERRIDES", "[]"))]
    if "STAGGER_FILES" in environment:
        command += [f"--files={environment['STAGGER_FILES']}"]
    command += ["--", path]  # It may begin with a dash.
    # A scene that cannot run without this node still has its values: it says so by its exit code, and prints them.
    asked = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    if not asked.stdout:
        raise RuntimeError(f"`{' '.join(command)}` failed with code {asked.returncode}: {asked.stderr.strip()}")
    report = json.loads(asked.stdout)
    if report["format"] != FORMAT:
        raise RuntimeError(f"`{command[0]}` speaks {report['format']}, but this kit reads {FORMAT}")
    return report
