"""Build a wheel and an sdist in dist/, install them into empty environments, and use them there.

python tools/try_wheel.py
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import kfsheet

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"


def run(*command: str | Path, cwd: Path, status: int = 0) -> str:
    """Run a command that must leave with this status; returns all that it says."""
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True)
    said = done.stdout + done.stderr
    if done.returncode != status or "Traceback" in said:
        sys.exit(f"{' '.join(map(str, command))}: status {done.returncode}\n{said}")
    return said


def environment(folder: Path, name: str, *requirements: str) -> Path:
    """An environment that holds what these requirements bring; returns where its programs lie."""
    uv = Path(sys.executable).with_name("uv")
    run(uv, "venv", "--python", sys.executable, name, cwd=folder)
    run(uv, "pip", "install", "--python", folder / name, *requirements, cwd=folder)
    return folder / name / "bin"


def try_without_extras(folder: Path, wheel: Path) -> None:
    """It builds and shows; what needs an engine says which extra brings one."""
    core = environment(folder, "core", str(wheel))
    assert run(core / "kfsheet", "--version", cwd=folder) == f"kfsheet {kfsheet.__version__}\n"
    run(core / "kfsheet", "build", "football", "--out", "out", cwd=folder)
    committed = (ROOT / "workbooks" / "football.xlsx").read_bytes()
    assert (folder / "out" / "football.xlsx").read_bytes() == committed
    assert "K_x" in run(core / "kfsheet", "show", "football", "--as", "python", cwd=folder)
    said = run(core / "kfsheet", "check", "out/football.xlsx", cwd=folder, status=2)
    assert "kfsheet[check]" in said, said
    check_types(folder, core / "python")


def check_types(folder: Path, python: Path) -> None:
    """The hints are in the wheel: a user's script is typed beside the installed package."""
    options = ("--config-file", ROOT / "pyproject.toml", "--python-executable", python)
    script = ROOT / "tests" / "package" / "users_script.py"
    run(sys.executable, "-m", "mypy", *options, script, cwd=folder)


def try_check(folder: Path, wheel: Path) -> None:
    """With the extra, what was built is right."""
    kfsheet_ = environment(folder, "check", f"kfsheet[check] @ {wheel.as_uri()}") / "kfsheet"
    assert "agree with NumPy" in run(kfsheet_, "check", "out/football.xlsx", cwd=folder)


def try_sdist(folder: Path, sdist: Path) -> None:
    """The sdist makes the same package."""
    kfsheet_ = environment(folder, "sdist", str(sdist)) / "kfsheet"
    assert "K_x" in run(kfsheet_, "show", "football", "--as", "table", cwd=folder)


def built() -> tuple[Path, Path]:
    """The wheel and the sdist, of the version that the package tells and a tag, if any, repeats."""
    shutil.rmtree(DIST, ignore_errors=True)
    run(sys.executable, "-m", "build", "--outdir", DIST, cwd=ROOT)
    wheel, sdist = *DIST.glob("*.whl"), *DIST.glob("*.tar.gz")
    assert wheel.name.startswith(f"kfsheet-{kfsheet.__version__}-")
    tag = run("git", "tag", "--points-at", "HEAD", "v*", cwd=ROOT).strip()
    assert tag in {"", f"v{kfsheet.__version__}"}, f"{tag} is not v{kfsheet.__version__}"
    return wheel, sdist


def main() -> None:
    """Build, install, use."""
    wheel, sdist = built()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try_without_extras(folder, wheel)
        try_check(folder, wheel)
        try_sdist(folder, sdist)
    for path in (wheel, sdist):
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB, installed and tried")


if __name__ == "__main__":
    main()
