"""Every example runs, and what the README shows is what the examples say today."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
PICTURE = ROOT / "docs" / "falling_error.svg"
NUMBER = re.compile(r"-?\d+\.\d+")


def run(script: Path, folder: Path, *arguments: str) -> str:
    command = [sys.executable, "-W", "error", str(script), *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def blocks(document: str, language: str) -> list[str]:
    """The fenced blocks of a document that are marked with a language."""
    text = (ROOT / document).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)


def assert_says_the_same(shown: str, said: str, cure: str):
    """The same words, and numbers that differ by no more than another machine's rounding."""
    assert NUMBER.sub("#", shown) == NUMBER.sub("#", said), cure
    numbers = [[float(text) for text in NUMBER.findall(part)] for part in (shown, said)]
    assert numbers[0] == pytest.approx(numbers[1], rel=0.02, abs=0.011), cure


def labels(picture: Path) -> str:
    """The texts of a picture that matplotlib drew with glyphs as paths; it leaves each text in a comment."""
    return "\n".join(re.findall(r"<!-- (.*?) -->", picture.read_text(encoding="utf-8"))).replace("−", "-")


def test_the_readme_shows_the_quickstart_and_its_output(tmp_path: Path):
    script = ROOT / "examples" / "quickstart.py"
    assert blocks("README.md", "python") == [script.read_text(encoding="utf-8")]
    said = run(script, tmp_path)
    assert (tmp_path / "blueboat-run" / "report.html").is_file()
    assert_says_the_same(blocks("README.md", "text")[0], said, "copy the output of examples/quickstart.py to README.md")


def test_the_picture_is_up_to_date(tmp_path: Path):
    run(ROOT / "examples" / "falling_error.py", tmp_path, "picture.svg")
    assert_says_the_same(labels(PICTURE), labels(tmp_path / "picture.svg"), "run python examples/falling_error.py")


@pytest.mark.parametrize(
    "script", [p for p in EXAMPLES if p.stem not in ("quickstart", "falling_error")], ids=lambda path: path.stem
)
def test_the_example_runs(script: Path, tmp_path: Path):
    assert run(script, tmp_path).strip()


@pytest.mark.parametrize("document", ["README.md", *(f"docs/{p.name}" for p in sorted((ROOT / "docs").glob("*.md")))])
def test_links_in_the_documents_lead_somewhere(document: str):
    text = (ROOT / document).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", text):
        if not target.startswith(("http://", "https://")):
            assert ((ROOT / document).parent / target).exists(), f"{document} links to {target}, which is not there"
