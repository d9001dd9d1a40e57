"""What a release and a pull request rest on: versions that agree, whole addresses, workflows that can run."""

import re
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml
from documents import links
from places import ROOT

ADDRESSES = runpy.run_path(str(ROOT / ".github" / "addresses.py"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
REPOSITORY = "https://example.org/boats/undertow"
TAG = f"v{PROJECT['version']}"
MOST_OF_A_VERSION = 60
"""Lines of the changelog: what a user reads before an update."""
FORMS = sorted((ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"))


def loaded(path: str) -> Any:
    return yaml.safe_load((ROOT / path).read_text(encoding="utf-8"))


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """The files that a release changes or looks at, the changelog with a date."""
    for name in ("README.md", "pyproject.toml", "CITATION.cff", "CHANGELOG.md"):
        shutil.copy(ROOT / name, tmp_path)
    changelog = tmp_path / "CHANGELOG.md"
    text = changelog.read_text(encoding="utf-8")
    changelog.write_text(
        text.replace(f"## {PROJECT['version']}, unreleased", f"## {PROJECT['version']}, 2027-01-31"), "utf-8"
    )
    return tmp_path


def test_the_version_is_the_same_everywhere():
    assert loaded("CITATION.cff")["version"] == PROJECT["version"]
    newest = re.search(r"^## (\S+), ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert newest
    assert newest[1] == PROJECT["version"]


def test_the_changelog_is_for_users():
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.split(r"^## ", text, flags=re.MULTILINE)[1]
    assert re.findall(r"^### (.+)$", newest, re.MULTILINE) == ["Added", "Changed", "Removed", "Fixed"]
    assert len(newest.splitlines()) <= MOST_OF_A_VERSION, "join what belongs together, or move it to docs/history.md"


def test_a_release_writes_whole_addresses(checkout: Path) -> None:
    before = links("README.md")
    ADDRESSES["main"](checkout, REPOSITORY, TAG)
    page = (checkout / "README.md").read_text(encoding="utf-8")
    for target in before:
        whole = f"{REPOSITORY}/{'raw' if re.search(r'[.](svg|webp)$', target) else 'blob'}/{TAG}/{target}"
        assert f"]({whole})" in page
    assert re.findall(r"\]\((?!https://)[^)]*\)", page) == []
    project = tomllib.loads((checkout / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["urls"]["Repository"] == REPOSITORY
    assert {**project, "urls": {}} == {**PROJECT, "urls": {}}


def test_a_release_that_contradicts_itself_is_refused(checkout: Path) -> None:
    with pytest.raises(SystemExit, match=f"the tag is v9.9.9, pyproject.toml says {PROJECT['version']}"):
        ADDRESSES["main"](checkout, REPOSITORY, "v9.9.9")
    shutil.copy(ROOT / "CHANGELOG.md", checkout)
    if "unreleased" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"):
        with pytest.raises(SystemExit, match="CHANGELOG.md should begin with"):
            ADDRESSES["main"](checkout, REPOSITORY, TAG)
    (checkout / "CITATION.cff").write_text("version: 0.0.1\n", encoding="utf-8")
    with pytest.raises(SystemExit, match="CITATION.cff says 0.0.1"):
        ADDRESSES["main"](checkout, REPOSITORY, TAG)


def test_no_address_is_in_the_sources():
    assert "urls" not in PROJECT
    assert [target for target in links("README.md") if ":" in target] == []


def test_every_python_that_is_named_is_tested():
    named = [word.rpartition(" ")[2] for word in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", word)]
    matrix = loaded(".github/workflows/ci.yml")["jobs"]["test"]["strategy"]["matrix"]
    assert (
        matrix["python"]
        == named
        == loaded(".github/workflows/release.yml")["jobs"]["try"]["strategy"]["matrix"]["python"]
    )
    assert [name.partition("-")[0] for name in matrix["os"]] == ["ubuntu", "macos", "windows"]


def test_what_workflows_run_is_there():
    for path in (ROOT / ".github" / "workflows").glob("*.yml"):
        text = path.read_text(encoding="utf-8")
        for job in yaml.safe_load(text)["jobs"].values():
            steps = " ".join(step.get("run", "") for step in job.get("steps", ()))
            for word in re.findall(r"(?:tests|\.github)/[\w/.]+", steps):
                assert (ROOT / word).exists(), f"{path.name} runs {word}"
            for target in re.findall(r"make (\w+)", steps):
                assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
        assert not re.search(r"password|secrets\.", text), "publishing is trusted: there is no token"


def test_only_the_job_that_publishes_may_speak_for_the_project():
    workflow = loaded(".github/workflows/release.yml")
    allowed = {name for name, job in workflow["jobs"].items() if job.get("permissions", {}).get("id-token") == "write"}
    assert allowed == {"publish"}
    assert workflow["permissions"] == {"contents": "read"}


@pytest.mark.parametrize("path", FORMS, ids=lambda path: path.stem)
def test_forms_ask_for_the_inspection(path: Path) -> None:
    form = yaml.safe_load(path.read_text(encoding="utf-8"))
    if path.stem == "config":
        return
    assert {"name", "description", "body"} <= set(form)
    asked = [item for item in form["body"] if item["type"] != "markdown"]
    assert len({item["id"] for item in asked}) == len(asked)
    labels = [item["attributes"]["label"] for item in asked]
    assert any(label.startswith("undertow inspect LOG") and label.endswith("--json") for label in labels)


def test_hooks_have_the_pinned_ruff():
    pins = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    (pinned,) = [line for line in pins if line.startswith("ruff==")]
    (hooks,) = [repository["hooks"] for repository in loaded(".pre-commit-config.yaml")["repos"]]
    assert {word for hook in hooks for word in hook["additional_dependencies"]} == {pinned}


def test_the_archive_of_sources_has_tests_and_documents(tmp_path: Path) -> None:
    source = tmp_path / "source"
    shutil.copytree(
        ROOT, source, ignore=shutil.ignore_patterns(".git", ".venv", ".*_cache", "__pycache__", "build", "*.egg-info")
    )
    build = f"from setuptools.build_meta import build_sdist; build_sdist({str(tmp_path)!r})"
    subprocess.run([sys.executable, "-c", build], cwd=source, capture_output=True, check=True)
    (found,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(found) as held:
        names = {name.partition("/")[2] for name in held.getnames()}
    for name in (
        "tests/test_release.py",
        "tests/helpers/documents.py",
        "docs/index.md",
        "docs/conf.py",
        "constraints.txt",
    ):
        assert name in names
    for name in (
        ".github/addresses.py",
        "benchmarks/records/plain-tuning.jsonl.gz",
        "app/plots/uplot/LICENSE",
        ".ci/run",
    ):
        assert name in names
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]
