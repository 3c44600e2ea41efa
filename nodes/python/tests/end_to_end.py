"""The thermal node in Python in a whole run, against the built-in one. Needs `target/release/stagger` and `mcap`.

    python nodes/python/tests/end_to_end.py

Two whole runs of deposition-laser take some ten seconds each, the others seconds.
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
# Light that falls on every particle alike, beside that of the laser.
LAMP = """
import numpy as np
from stagger import Node, Port, Reply, run

class Lamp(Node):
    writes = [Port("absorbed_power", "W", "particles", measure="magnitude")]

    def initial(self):
        return None, Reply({"absorbed_power": np.full(self.scene["physics"]["thermal"]["count"], 1e-3)})

    def solve(self, state, frozen, window):
        return self.initial()

run(Lamp)
"""
# Reads the temperature and is read by nobody: solves when the others have converged.
WATCH = """
import numpy as np
from stagger import Node, Port, Reply, run

class Watch(Node):
    reads = [Port("temperature", "K", "particles")]
    writes = [Port("kelvin_seconds", "K s", "one", measure="magnitude")]

    def initial(self):
        return 0.0, Reply({"kelvin_seconds": np.zeros(1)})

    def solve(self, state, frozen, window):
        state += window.dt_s * float(np.mean(frozen.start["temperature"] + frozen.end["temperature"])) / 2
        return state, Reply({"kelvin_seconds": np.array([state])})

run(Watch)
"""


def accepted(path: Path) -> dict[Version, dict[str, np.ndarray]]:
    """The accepted values of the fields compared, by version; those a node committed before where it rested."""
    values: dict[str, dict[Version, np.ndarray]] = {name: {} for name in FIELDS.values()}
    versions, found = [INITIAL], {}
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
    for version in versions:
        before = found.get(versions[len(found) - 1], {})
        found[version] = {name: known[version] if version in known else before[name] for name, known in values.items()}
    return found


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

    def node(self, script: Path = EXAMPLE, name: str = "thermal") -> list[str]:
        # The folder, which the node does not read, is how its process is found.
        words = [sys.executable, str(script), str(self.folder)]
        return ["--node", f"{name}={' '.join(map(shlex.quote, words))}"]

    def written(self, name: str, text: str) -> list[str]:
        """A node of this name with this text."""
        script = self.folder / f"{name}.py"
        script.write_text(text)
        return self.node(script, name)

    def begin(self, scene: str, *more: str) -> subprocess.Popen[bytes]:
        command = self.command(scene, "--json", *more)
        pipe = subprocess.PIPE
        run = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe)
        self.addCleanup(run.kill)
        return run

    def summary(self, run: subprocess.Popen[bytes]) -> dict[str, Any]:
        output, diagnostics = run.communicate()
        self.assertEqual(run.returncode, 0, diagnostics.decode())
        return json.loads(output)

    def run_scene(self, scene: str, *more: str) -> dict[str, Any]:
        return self.summary(self.begin(scene, *more))

    def assert_like(self, found: dict[str, Any], built_in: dict[str, Any]) -> dict[str, float]:
        """Compares two recorded runs step by step; the largest difference of each field, relative to its largest."""
        for name in ("accepted", "rejected", "iterations"):
            self.assertEqual(found["steps"][name], built_in["steps"][name], name)
        self.assertEqual(found["recording"]["lost"], 0)
        expected, values = accepted(Path(built_in["recording"]["path"])), accepted(Path(found["recording"]["path"]))
        self.assertEqual(list(values), list(expected))
        difference = dict.fromkeys(FIELDS.values(), 0.0)
        for version, fields in expected.items():
            for name, field in fields.items():
                largest = np.abs(values[version][name] - field).max() / np.abs(field).max()
                difference[name] = max(difference[name], float(largest))
        # The same operations in the same order: any difference is the mathematics library's, in the last bits.
        self.assertLess(max(difference.values()), 1e-9)
        return difference

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
        self.assertEqual(ours["refused"], 0)
        self.assertGreater(ours["steps"]["accepted"], 200)
        difference = self.assert_like(ours, built_in)
        print(f"\nbuilt-in {seconds[0]:.1f} s, Python {seconds[1]:.1f} s; largest relative differences", difference)
        self.assertEqual(self.processes(), [])

    def test_twice_the_same_bits_and_the_built_in_node_verifies_them(self) -> None:
        file = str(self.folder / "quick.mcap")
        changes = ["--set", "thermal.conductance=constriction", "--set", "thermal.phi=1"]
        hashes = {self.run_scene("quick.toml", "--record", file, "--overwrite", *changes, *self.node())["hash"] for _ in range(2)}
        self.assertEqual(len(hashes), 1)
        verified = subprocess.run([PROGRAM, "verify", file, "--tolerance", "1e-9"], capture_output=True, text=True)
        self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)

    def test_it_is_verified_alone_against_a_recording_of_the_built_in_node(self) -> None:
        file = str(self.folder / "run.mcap")
        # Until 0.2 ms after the laser has been switched on.
        self.run_scene("deposition-laser.toml", "--set", 'duration="2.2 ms"', "--record", file)
        command = [PROGRAM, "verify", file, "--node", "thermal", "--with", shlex.join([sys.executable, str(EXAMPLE)])]
        verified = subprocess.run([*command, "--tolerance", "1e-9", "--json"], capture_output=True, text=True)
        self.assertEqual(verified.returncode, 0, verified.stdout + verified.stderr)
        self.assertGreater(json.loads(verified.stdout)["steps"], 50)
        self.assertEqual(self.processes(), [])

    def test_a_node_of_its_own_rate_goes_on_with_the_same_bits_after_its_death_and_from_a_recording(self) -> None:
        def options(name: str, *more: str) -> list[str]:
            changes = ['duration="2.5 ms"', "recovery.checkpoint=10", "coupling.every.thermal=3"]
            sets = [word for change in changes for word in ("--set", change)]
            return ["deposition-laser.toml", *sets, "--record", str(self.folder / f"{name}.mcap"), *more]

        built_in = self.run_scene(*options("rust"))
        ours = self.run_scene(*options("python", *self.node()))
        self.assert_like(ours, built_in)

        run = self.begin(*options("killed", *self.node()))
        file = self.folder / "killed.mcap"
        wait_until("the recording to grow", lambda: file.exists() and file.stat().st_size > 5e6, 60)
        (process,) = [process for process in self.processes() if process != run.pid]
        os.kill(process, signal.SIGKILL)
        killed = self.summary(run)
        ((death,),) = [[restart["node"] for restart in killed["restarts"]]]
        self.assertEqual((death, killed["hash"]), ("thermal", ours["hash"]))

        resumed = self.run_scene(*options("resumed", *self.node(), "--resume", f"{self.folder}/python.mcap@65"))
        self.assertEqual(resumed["hash"], ours["hash"])

    def test_acceleration_a_second_writer_and_a_reader_change_nothing_about_being_the_built_in_one(self) -> None:
        others = [*self.written("lamp", LAMP), *self.written("watch", WATCH)]
        jacobi = 'coupling.order="jacobi"'
        for changes in ([], ['coupling.acceleration="iqn-ils"'], ['coupling.acceleration="aitken"', jacobi]):
            sets = [word for change in changes for word in ("--set", change)]
            runs = {}
            for name, node in (("rust", []), ("python", self.node())):
                record = ["--record", str(self.folder / f"{name}.mcap"), "--overwrite"]
                runs[name] = self.run_scene("quick.toml", *sets, *record, *others, *node)
            self.assert_like(runs["python"], runs["rust"])
            # The reader solves once a step, when the others have converged.
            steps = runs["python"]["steps"]
            self.assertEqual(runs["python"]["nodes"]["watch"]["solves"], steps["accepted"])
            self.assertGreater(steps["iterations"], steps["accepted"])

    def test_it_keeps_the_protocol(self) -> None:
        command = [str(PROGRAM), "conformance", "--", sys.executable, str(EXAMPLE), str(self.folder)]
        told = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        self.assertEqual(told.returncode, 0, told.stdout + told.stderr)
        self.assertIn(" 0 broken, 0 not applicable", told.stdout)

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
