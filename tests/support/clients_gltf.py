"""The Khronos glTF validator, driven from Python."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

PROJECT = Path(__file__).parents[2]

_SCRIPT = """
const validator = require('gltf-validator'), fs = require('fs'), path = require('path');
(async () => {
  const reports = [];
  for (const name of process.argv.slice(1)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(name)), {
      maxIssues: 50,
      externalResourceFunction: async uri =>
        new Uint8Array(fs.readFileSync(path.join(path.dirname(name), decodeURIComponent(uri)))),
    });
    reports.push(report);
  }
  process.stdout.write(JSON.stringify(reports));
})().catch(error => { console.error(error); process.exit(1); });
"""


def validator_folder() -> Path:
    """Return the `node_modules` that holds gltf-validator; skip the test where there is none.

    HAIRKIT_GLTF_VALIDATOR names it; else it is looked for in the project's `.clients` folder.
    """
    named = os.environ.get("HAIRKIT_GLTF_VALIDATOR")
    folder = Path(named) if named else PROJECT / ".clients" / "node_modules"
    if not (folder / "gltf-validator").is_dir():
        pytest.skip(f"no gltf-validator in {folder}: npm install gltf-validator there")
    if shutil.which("node") is None:
        pytest.skip("node is not installed")
    return folder


def validated(paths: Sequence[Path]) -> list[dict[str, Any]]:
    """Return the validator's report of each file."""
    environment = os.environ | {"NODE_PATH": str(validator_folder())}
    result = subprocess.run(
        ["node", "-e", _SCRIPT, "--", *map(str, paths)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    reports: list[dict[str, Any]] = json.loads(result.stdout)
    return reports


def complaints(paths: Sequence[Path]) -> list[str]:
    """Return every error, warning and information that the validator has about the files."""
    return [
        f"{path.name}: severity {message['severity']}, {message['code']} at"
        f" {message.get('pointer', '?')}: {message['message']}"
        for path, report in zip(paths, validated(paths), strict=True)
        for message in report["issues"]["messages"]
    ]
