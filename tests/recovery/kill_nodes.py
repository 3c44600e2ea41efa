#!/usr/bin/env python3
"""Kills (or stops) nodes of a run at random moments, again and again, and says what it cost.

    python3 tests/recovery/kill_nodes.py [--runs 20] [--signal KILL|STOP] [--kinds particles,thermal,optics]

Each run must end with the hash of an undisturbed one. Printed: from the signal to the message that the node is gone,
until all nodes are ready again, steps solved once more, and the wall time over that of the undisturbed run.
"""

import argparse
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 180


def run(program, scene, sets, victim=None, after_s=0.0, name="KILL"):
    """One run; returns its summary, and the time from the signal to the first word about it."""
    command = [program, "run", str(scene), "--no-record", "--json", *(f"--set={key}" for key in sets)]
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    noticed, sent = [], []

    def listen():
        for line in process.stderr:
            if "is gone" in line:
                noticed.append(time.monotonic())
            else:
                print(f"    {line.rstrip()}", file=sys.stderr)

    def strike():
        time.sleep(after_s)
        pid = node(process.pid, victim)
        if pid and process.poll() is None:
            sent.append(time.monotonic())
            os.kill(pid, getattr(signal, f"SIG{name}"))

    threads = [threading.Thread(target=listen)] + ([threading.Thread(target=strike)] if victim else [])
    for thread in threads:
        thread.start()
    watchdog = threading.Timer(LIMIT_S, process.kill)
    watchdog.start()
    output = process.stdout.read()
    code = process.wait()
    watchdog.cancel()
    for thread in threads:
        thread.join()
    if code != 0:
        sys.exit(f"the run ended with {code}: {victim} after {after_s:.2f} s")
    return json.loads(output), noticed[0] - sent[0] if noticed and sent else None


def node(parent, kind):
    """The process of a node of the run `parent`."""
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes().split(b"\0")
            above = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, ValueError, IndexError):
            continue
        if above == parent and words[1:3] == [b"node", kind.encode()]:
            return int(entry.name)
    return None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=str(ROOT / "target/release/stagger"))
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--signal", default="KILL", choices=["KILL", "STOP"])
    parser.add_argument("--kinds", default="particles,thermal,optics")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--duration", default="2.5 ms")
    arguments = parser.parse_args()
    scene = ROOT / "scenes/deposition-laser.toml"
    sets = [f'duration="{arguments.duration}"', "recovery.checkpoint=10"]
    undisturbed, _ = run(arguments.program, scene, sets)
    print(f"undisturbed: hash {undisturbed['hash']}, {undisturbed['wall_s']:.2f} s")
    chance, kinds = random.Random(arguments.seed), arguments.kinds.split(",")
    noticed, outages, repeated, lost, same = [], [], [], [], 0
    for number in range(arguments.runs):
        kind = kinds[number % len(kinds)]
        # From before the nodes have announced themselves to nearly the end.
        after_s = chance.uniform(0.02, 0.9 * undisturbed["wall_s"])
        summary, seen = run(arguments.program, scene, sets, kind, after_s, arguments.signal)
        same += summary["hash"] == undisturbed["hash"]
        restarts = summary["restarts"]
        outage = sum(restart["outage_s"] for restart in restarts)
        again = sum(restart["steps_repeated"] for restart in restarts)
        extra = summary["wall_s"] - undisturbed["wall_s"]
        at = restarts[0]["at"] if restarts else "nothing was hit"
        print(
            f"{number + 1:3} {kind:<10} after {after_s:5.2f} s, {at}: noticed in "
            f"{'-' if seen is None else f'{seen:.3f}'} s, ready after {outage:.2f} s, {again} steps once more, "
            f"{extra:+.2f} s in all, {'same hash' if summary['hash'] == undisturbed['hash'] else 'ANOTHER HASH'}"
        )
        if restarts and seen is not None:
            noticed.append(seen)
            outages.append(outage)
            repeated.append(again)
            lost.append(extra)
    if noticed:
        middle = statistics.median
        print(
            f"{same} of {arguments.runs} with the same hash; noticed in {middle(noticed):.3f} s (at most "
            f"{max(noticed):.3f}), ready after {middle(outages):.2f} s, {middle(repeated):.0f} steps once more, "
            f"{middle(lost):+.2f} s in all (medians)"
        )
    sys.exit(0 if same == arguments.runs else 1)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        main()
