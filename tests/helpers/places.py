"""Where the repository lies, whatever folder a test stands in."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
