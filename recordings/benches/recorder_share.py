"""What recording takes of a run: the processor time of the recorder's thread over the wall time (Linux).

    python3 recordings/benches/recorder_share.py [PARTICLES...]

deposition-laser with more particles at the same density, cut short; each run writes into the working directory, and its file is
removed. Uses `target/release/stagger`, or what STAGGER_PROGRAM names.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("STAGGER_PROGRAM", str(ROOT / "target/release/stagger"))
SCENE = str(ROOT / "scenes/deposition-laser.toml")
# Simulated time by particles: some 26, 12 and 5 steps.
DURATIONS = {2_000: "0.4 ms", 10_000: "0.13 ms", 100_000: "13 us"}
LEVELS = {
    "all, no frames": ['record.level="all"', "record.frames=0"],
    "all": ['record.level="all"'],
    "accepted": ['record.level="accepted"'],
    "every 10th": ['record.level="accepted"', "record.every=10"],
}
TICK_S = 1 / os.sysconf("SC_CLK_TCK")


def recorder_s(process: int) -> float | None:
    """Processor time of the thread called `recorder` so far; none where there is none."""
    for stat in Path(f"/proc/{process}/task").glob("*/stat"):
        try:
            name, rest = stat.read_text().split("(", 1)[1].rsplit(")", 1)
        except OSError:
            continue
        if name == "recorder":
            user, system = rest.split()[11:13]
            return (int(user) + int(system)) * TICK_S
    return None


def measure(particles: int, level: list[str]) -> tuple[float, int, float, float]:
    """File in MB, steps, processor time of the recorder and wall time of the run, in s."""
    width = 1e-3 * (particles / 2000) ** 0.5
    half = width / 2
    sets = [
        f"particles.count={particles}",
        f"particles.start.box=[{width}, {width}, 2e-3]",
        f"walls.sides.box={{ lower = [{-half}, {-half}, -1e-3], upper = [{half}, {half}, 3e-3] }}",
        f'duration="{DURATIONS.get(particles, "13 us")}"',
        *level,
    ]
    file = Path("recorder-share.mcap")
    command = [PROGRAM, "run", SCENE, "--record", str(file), "--overwrite", "--json"]
    command += [word for value in sets for word in ("--set", value)]
    run = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    spent = 0.0
    # The summary fits into the pipe.
    while run.poll() is None:
        spent = recorder_s(run.pid) or spent
        time.sleep(0.01)
    told = json.loads(run.stdout.read())
    size = file.stat().st_size / 1e6
    file.unlink()
    return size, told["steps"]["accepted"], spent, told["wall_s"]


def main(sizes: list[int]) -> None:
    print("| particles | level | file MB | recorder's thread, s | wall s | share |\n|---|---|---|---|---|---|")
    for particles in sizes:
        for name, level in LEVELS.items():
            size, steps, spent, wall = measure(particles, level)
            print(f"| {particles}, {steps} steps | {name} | {size:.1f} | {spent:.2f} | {wall:.2f} | {spent / wall:.1%} |", flush=True)


if __name__ == "__main__":
    main([int(argument) for argument in sys.argv[1:]] or list(DURATIONS))
