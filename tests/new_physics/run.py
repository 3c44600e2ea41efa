"""Adds a physics to a copy of the sources, by its folder and its lines in the two lists, and uses it in every way a user would.

    python3 tests/new_physics/run.py WORKING_FOLDER

The copy is built in the working folder. Nothing else of it is changed: `git diff` of the copy is what an addition takes.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
LISTS = {
    "solver/physics/src/lib.rs": ("pub mod current;\n", "pub mod current;\npub mod decay;\n"),
    "solver/scene/src/built_in.rs": (
        "    &acoustics::keys::KIND,\n",
        "    &acoustics::keys::KIND,\n    &stagger_physics::decay::keys::KIND,\n",
    ),
}


def main() -> None:
    work = Path(sys.argv[1]).resolve()
    copy = work / "sources"
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir(parents=True)
    archive = subprocess.run(["git", "-C", ROOT, "archive", "HEAD"], check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", copy], input=archive, check=True)
    shutil.copytree(HERE / "decay", copy / "solver/physics/src/decay")
    for path, (before, after) in LISTS.items():
        text = (copy / path).read_text()
        assert text.count(before) == 1, f"{path} has another form now"
        (copy / path).write_text(text.replace(before, after))
    # Libraries of others are the same: linked, not copied. The lock and all that is made of our own sources are this folder's own:
    # what cargo writes into a linked file would change in both.
    if (ROOT / "target/release").is_dir() and not (work / "target/release").exists():
        (work / "target").mkdir(exist_ok=True)
        release = work / "target/release"
        subprocess.run(["cp", "-al", ROOT / "target/release", release], check=True)
        (release / ".cargo-lock").unlink(missing_ok=True)
        for folder in [*release.glob(".fingerprint/stagger-*"), *release.glob("build/stagger-*")]:
            shutil.rmtree(folder)
        for file in {*release.glob("deps/*stagger*"), *release.glob("deps/*.d")}:
            file.unlink()
    # A test of the whole workspace brings the program along, with the libraries' features that are linked here.
    build = ["cargo", "test", "--release", "--workspace", "--features", "quic", "--locked", "--test", "tidy", "--no-run"]
    subprocess.run([*build, "--manifest-path", copy / "Cargo.toml", "--target-dir", work / "target"], check=True)
    stagger = work / "target/release/stagger"
    scene = HERE / "decay.toml"

    def run(*arguments: str) -> str:
        done = subprocess.run([stagger, *arguments], cwd=work, capture_output=True, text=True)
        assert done.returncode == 0, f"{arguments}: {done.stderr}"
        return done.stdout

    # 24 cells of 1 to 24 at the start; four half-lives.
    checked = json.loads(run("check", str(scene), "--json"))
    assert math.isclose(checked["physics"]["decay"]["rate_1_s"], math.log(2) / 1e-3), checked["physics"]
    summary = json.loads(run("run", str(scene), "--record", "decay.mcap", "--overwrite", "--json"))
    mean = next(field for field in summary["fields"] if field["field"] == "mean_concentration")["mean"]
    assert math.isclose(mean, 12.5 / 16, rel_tol=1e-14), mean
    assert abs(summary["imbalance"]["decay"]) < 1e-14, summary["imbalance"]
    verified = json.loads(run("verify", "decay.mcap", "--json"))
    assert verified["difference"] is None and verified["trials"]["decay"] > 0, verified
    resumed = json.loads(run("run", str(scene), "--resume", "decay.mcap@4", "--no-record", "--json"))
    assert resumed["hash"] == summary["hash"], (resumed["hash"], summary["hash"])
    assert "concentration" in run("info", "decay.mcap")
    run("export", "decay.mcap", "--out", "series", "--overwrite")
    images = sorted((work / "series").glob("**/*.vti"))
    assert images and 'WholeExtent="0 4 0 3 0 2"' in images[-1].read_text(errors="replace"), images
    run("report", "decay.mcap", "--out", "decay.html", "--overwrite")
    assert "concentration" in (work / "decay.html").read_text()
    if (ROOT / "recordings/view/target/release/stagger-view").is_file():
        run("view", "decay.mcap", "--save", "decay.rrd", "--overwrite")
        assert b"world/faces" in (work / "decay.rrd").read_bytes(), "the grid is not drawn"
    named = subprocess.run(["grep", "-rlwi", "decay::keys\\|mod decay", copy / "solver", copy / "nodes", copy / "recordings"],
                           capture_output=True, text=True).stdout.split()
    names = sorted(str(Path(path).relative_to(copy)) for path in named)
    assert names == sorted(LISTS), names
    print(f"a physics of its own ran, was verified, resumed, exported, reported and viewed; beside its folder {len(names)} files name it")


if __name__ == "__main__":
    main()
