"""The thermal node in Python in a whole run, against the built-in one. Needs `target/release/stagger` and `mcap`.

    python nodes/python/tests/end_to_end.py

Two runs of deposition-laser take about half a minute each.
"""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

from stagger.fields import receive_message
from stagger.messages import ACCEPT, INITIAL, Directive, FieldMessage, Version

ROOT = Path(__file__).resolve().parents[3]
PROGRAM = Path(os.environ.get("STAGGER_PROGRAM", ROOT / "target/release/stagger"))
EXAMPLE = ROOT / "nodes/python/examples/thermal.py"
FIELDS = {"field/thermal/temperature": "temperature", "field/particles/positions": "positions"}
# A node that is in the middle of a long `solve` when its parent dies.
SLOW = f"""
import sys, time
sys.path.insert(0, {str(EXAMPLE.parent)!r})
from thermal import Thermal, run

class Slow(Thermal):
    def solve(self, state, frozen, window):
        time.sleep(600)

run(Slow)
"""


def accepted(path: Path) -> dict[Version, dict[str, np.ndarray]]:
    """The accepted values of the fields compared, by version."""
    values: dict[str, dict[Version, np.ndarray]] = {name: {} for name in FIELDS.values()}
    versions = [INITIAL]
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=[*FIELDS, "ctl/directive"]):
            if channel.topic in FIELDS:
                field = receive_message(FieldMessage.FromString(message.data))
                known, version = values[FIELDS[channel.topic]], Version.of(field.envelope.version)
                known[version] = known[field.same_as] if field.field is None else field.field.values
                continue
            decision = Directive.FromString(message.data).decision
            if decision.verdict == ACCEPT and Version.of(decision.version) != versions[-1]:
                versions.append(Version.of(decision.version))
    return {version: {name: known[version] for name, known in values.items()} for version in versions}


def wait_until(what: str, probe: Callable[[], Any], patience_s: float) -> None:
    begun = time.monotonic()
    while not probe():
        if time.monotonic() - begun > patience_s:
            raise AssertionError(f"waited in vain for {what}")
        time.sleep(0.02)


class WholeRun(unittest.TestCase):
    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def command(self, scene: str, *more: str) -> list[str]:
        return [str(PROGRAM), "run", str(ROOT / "scenes" / scene), *more]

    def node(self, script: Path = EXAMPLE) -> list[str]:
        # The folder, which the node does not read, is how its process is found.
        words = [sys.executable, str(script), str(self.folder)]
        return ["--node", f"thermal={' '.join(map(shlex.quote, words))}"]

    def run_scene(self, scene: str, *more: str) -> dict[str, Any]:
        done = subprocess.run(self.command(scene, "--json", *more), stdin=subprocess.DEVNULL, capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr.decode())
        return json.loads(done.stdout)

    def processes(self) -> list[int]:
        found = []
        for entry in Path("/proc").iterdir():
            try:
                if entry.name.isdecimal() and str(self.folder).encode() in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except OSError:
                pass  # A process may end while it is looked at.
        return found

    def test_deposition_laser_is_the_one_of_the_built_in_node(self) -> None:
        begun = time.monotonic()
        built_in = self.run_scene("deposition-laser.toml", "--record", str(self.folder / "rust.mcap"))
        middle = time.monotonic()
        ours = self.run_scene("deposition-laser.toml", "--record", str(self.folder / "python.mcap"), *self.node())
        seconds = middle - begun, time.monotonic() - middle
        for name in ("accepted", "rejected", "iterations"):
            self.assertEqual(ours["steps"][name], built_in["steps"][name], name)
        self.assertEqual((ours["refused"], ours["recording"]["lost"]), (0, 0))
        expected, found = accepted(self.folder / "rust.mcap"), accepted(self.folder / "python.mcap")
        self.assertEqual(list(found), list(expected))
        self.assertGreater(len(found), 400)
        difference = dict.fromkeys(FIELDS.values(), 0.0)
        for version, fields in expected.items():
            for name, values in fields.items():
                largest = np.abs(values).max()
                difference[name] = max(difference[name], np.abs(found[version][name] - values).max() / largest)
        print(f"\n{len(found) - 1} accepted steps; built-in {seconds[0]:.1f} s, Python {seconds[1]:.1f} s", end="; ")
        print("largest relative differences", {name: float(f"{value:.1e}") for name, value in difference.items()})
        # The same operations in the same order: any difference is the mathematics library's, in the last bits.
        self.assertLess(max(difference.values()), 1e-9)
        self.assertEqual(self.processes(), [])

    def test_twice_the_same_bits_and_the_built_in_node_verifies_them(self) -> None:
        file = str(self.folder / "quick.mcap")
        changes = ["--set", "thermal.conductance=constriction", "--set", "thermal.phi=1"]
        hashes = {self.run_scene("quick.toml", "--record", file, *changes, *self.node())["hash"] for _ in range(2)}
        self.assertEqual(len(hashes), 1)
        verified = subprocess.run([PROGRAM, "verify", file, "--tolerance", "1e-9"], capture_output=True, text=True)
        self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)

    def test_no_process_outlives_a_killed_run(self) -> None:
        slow = self.folder / "slow.py"
        slow.write_text(SLOW)
        for script, record in ((EXAMPLE, ["--record", str(self.folder / "run.mcap")]), (slow, ["--no-record"])):
            command = self.command("deposition-laser.toml", *record, *self.node(script))
            run = subprocess.Popen(command, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                if script is EXAMPLE:
                    file = self.folder / "run.mcap"
                    wait_until("the recording to grow", lambda: file.exists() and file.stat().st_size > 2e6, 60)
                else:
                    wait_until("the node to start", lambda: len(self.processes()) > 1, 60)
                    time.sleep(2)  # Its first solve begins within a second of that.
                self.assertGreater(len(self.processes()), 1)
            finally:
                run.send_signal(signal.SIGKILL)
                run.wait()
            wait_until("all processes to be gone", lambda: not self.processes(), 5)

    def test_an_exception_ends_the_run_with_its_words(self) -> None:
        broken = self.folder / "broken.py"
        broken.write_text(SLOW.replace("time.sleep(600)", "raise ValueError('no idea')"))
        command = self.command("quick.toml", "--no-record", *self.node(broken))
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("thermal: ValueError: no idea", done.stderr)
        self.assertEqual(self.processes(), [])


if __name__ == "__main__":
    unittest.main()
