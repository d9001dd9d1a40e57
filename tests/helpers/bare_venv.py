"""A venv with the dependencies of this one and nothing of undertow, to install it into."""

import subprocess
import sysconfig
import venv
from pathlib import Path


class BareVenv:
    """A new venv; what a .pth file names is on the path, but .pth files in there, as of this undertow, are not read."""

    def __init__(self, place: Path) -> None:
        venv.create(place)  # an own pip would bring the setuptools of years ago
        base = {"base": str(place)}
        self.scripts = Path(sysconfig.get_path("scripts", vars=base))
        self.packages = Path(sysconfig.get_path("purelib", vars=base))
        ours = {sysconfig.get_path(name) for name in ("purelib", "platlib")}
        (self.packages / "dependencies.pth").write_text("\n".join(sorted(ours)) + "\n", "utf-8")
        pip = self.scripts / "pip"
        pip.write_text('#!/bin/sh\nexec "$(dirname "$0")/python" -m pip "$@"\n', "utf-8")
        pip.chmod(0o755)

    def run(self, *words: str | Path, cwd: Path) -> str:
        """Run one of its programs, expect success, and give back what it printed."""
        words = (self.scripts / words[0], *words[1:])
        done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout
