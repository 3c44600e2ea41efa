#!/usr/bin/env python3
"""A run over two network namespaces with a bad link between them. Needs root, iproute2, openssl and a built program.

    python3 tests/network/run.py

Coordinator, particles and optics are in one namespace, thermal is in the other. All traffic stays between the two.
"""

import atexit
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from relay import End, Relay, ip

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target/release/stagger"
SCENE = ROOT / "scenes/quick.toml"
HERE, THERE = (f"stagger-{os.getpid()}-{side}" for side in ("here", "there"))
ADDRESS_HERE, ADDRESS_THERE = "10.231.77.1", "10.231.77.2"
ADDRESS = f"{ADDRESS_HERE}:7447"
DELAY_S = 1e-3
LOSS = 0.01
LEASE_S = 5.0
# Everything here takes some seconds; whatever takes longer than this hangs.
PATIENCE_S = 120


def remove_namespaces():
    for namespace in (HERE, THERE):
        # One that is not there need not be removed.
        subprocess.run(["ip", "netns", "del", namespace], stderr=subprocess.DEVNULL, timeout=20)


def stagger(*arguments):
    return [str(PROGRAM), *map(str, arguments)]


class Network(unittest.TestCase):
    def setUp(self):
        remove_namespaces()
        self.processes = []
        self.addCleanup(self.clean)
        for namespace in (HERE, THERE):
            ip("netns", "add", namespace)
            ip("-n", namespace, "link", "set", "lo", "up")
        device = f"stg{os.getpid()}"
        self.ends = [End(f"{device}a", HERE, ADDRESS_HERE), End(f"{device}b", THERE, ADDRESS_THERE)]
        self.relay = None

    def clean(self):
        for process in self.processes:
            process.kill()
            process.communicate()
        if self.relay:
            self.relay.close()
        remove_namespaces()

    def connect(self, loss=LOSS):
        self.relay = Relay(self.ends, DELAY_S, loss)

    def start(self, namespace, *arguments):
        command = ["ip", "netns", "exec", namespace, *stagger(*arguments)]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        self.processes.append(process)
        return process

    def start_run(self, *settings, coordinator=(), node=lambda kind: (), endpoint=f"tcp/{ADDRESS}"):
        """The coordinator, the nodes here, the node there."""
        coordinator = coordinator or ("--listen", endpoint)
        self.coordinator = self.start(
            HERE, "coordinator", SCENE, *settings, "--run", "network", "--no-record", "--json", *coordinator
        )
        self.nodes = {}
        for kind, namespace in (("particles", HERE), ("optics", HERE), ("thermal", THERE)):
            self.nodes[kind] = self.start(
                namespace, "node", kind, "--scene", SCENE, *settings, "--connect", endpoint, "--run", "network", *node(kind)
            )

    def summary(self):
        result, said = self.coordinator.communicate(timeout=PATIENCE_S)
        self.assertEqual(self.coordinator.returncode, 0, said)
        for kind, process in self.nodes.items():
            _, said = process.communicate(timeout=PATIENCE_S)
            self.assertEqual(process.returncode, 0, f"{kind}: {said}")
        return json.loads(result)

    def alone(self, *settings):
        command = stagger("run", SCENE, *settings, "--no-record", "--json")
        return json.loads(subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE_S).stdout)

    def tell(self, what, alone, over):
        windows = over["steps"]["iterations"]
        print(
            f"{what}: {over['wall_s']:.2f} s against {alone['wall_s']:.2f} s on one host, {windows} iterations, "
            f"{1e3 * over['wall_s'] / windows:.1f} ms each; {self.relay.carried} packets carried, {self.relay.lost} lost",
            flush=True,
        )

    def test_latency_and_loss_change_no_bit(self):
        self.connect()
        self.start_run()
        over, alone = self.summary(), self.alone()
        self.assertEqual(over["hash"], alone["hash"])
        self.assertGreater(self.relay.lost, 0, "the link lost nothing: the test shows nothing")
        self.tell("1 ms, 1 % loss", alone, over)

    def test_a_cut_shorter_than_the_lease_is_waited_out(self):
        # Long enough to be cut in its middle: some seconds with this link.
        settings = ("--set", "duration=5 ms")
        self.connect(loss=0)
        self.start_run(*settings)
        self.wait_for_traffic()
        self.relay.cut(3.0)
        lost_before = self.relay.lost
        over, alone = self.summary(), self.alone(*settings)
        self.assertEqual(over["hash"], alone["hash"])
        self.assertGreater(self.relay.lost, lost_before)
        self.assertGreater(over["wall_s"], 3.0, "the run was over before the cut")
        self.tell("a cut of 3 s", alone, over)

    def test_a_cut_longer_than_the_lease_names_the_node(self):
        self.connect(loss=0)
        self.start_run("--set", "duration=50 ms", "--set", "recovery.restarts=0")
        self.wait_for_traffic()
        self.relay.cut(60.0)
        begun = time.monotonic()
        _, said = self.coordinator.communicate(timeout=PATIENCE_S)
        noticed = time.monotonic() - begun
        self.assertEqual(self.coordinator.returncode, 1)
        self.assertIn("node `thermal` is gone", said)
        _, said = self.nodes["thermal"].communicate(timeout=PATIENCE_S)
        self.assertEqual(self.nodes["thermal"].returncode, 1)
        self.assertIn("the coordinator is gone", said)
        # Zenoh looks once in a lease, and the others have a few seconds for their final reports.
        self.assertLess(noticed, 2 * LEASE_S + 5.0)
        print(f"a cut for good: told after {noticed:.1f} s", flush=True)

    def test_a_longer_lease_of_the_configuration_file_waits_longer(self):
        settings = ("--set", "duration=5 ms")
        with tempfile.NamedTemporaryFile("w", suffix=".json5") as file:
            file.write("{ transport: { link: { tx: { lease: 30000 } } } }")
            file.flush()
            self.connect(loss=0)
            patient = ("--config", file.name)
            self.start_run(*settings, coordinator=("--listen", f"tcp/{ADDRESS}", *patient), node=lambda _: patient)
            self.wait_for_traffic()
            self.relay.cut(LEASE_S + 2.0)
            over, alone = self.summary(), self.alone(*settings)
        self.assertEqual(over["hash"], alone["hash"])
        self.assertGreater(over["wall_s"], LEASE_S + 2.0, "the run was over before the cut")
        self.tell("a cut of 7 s, lease 30 s", alone, over)

    def test_certificates_of_the_script_and_a_router_over_the_bad_link(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        script = ROOT / "docs/several-hosts/make-certificates.sh"
        names = ["coordinator", "particles", "optics", "thermal"]
        subprocess.run([script, folder, ADDRESS_HERE, *names], check=True, timeout=60, stdin=subprocess.DEVNULL)
        # Once more with another name adds it.
        subprocess.run([script, folder, ADDRESS_HERE, "unknown"], check=True, timeout=60, stdin=subprocess.DEVNULL)
        config = lambda name: ("--config", folder / name / "zenoh.json5")
        self.connect()
        endpoint = f"quic/{ADDRESS}"
        router = self.start(HERE, "router", "--listen", endpoint, *config("hub"))
        stranger = self.start(
            THERE, "node", "thermal", "--scene", SCENE, "--connect", endpoint, "--run", "network", *config("unknown")
        )
        self.start_run(
            coordinator=("--connect", endpoint, *config("coordinator")), node=config, endpoint=endpoint
        )
        over, alone = self.summary(), self.alone()
        self.assertEqual(over["hash"], alone["hash"])
        self.assertIsNone(stranger.poll(), "the stranger heard that the run was over")
        router.send_signal(signal.SIGINT)
        _, said = router.communicate(timeout=PATIENCE_S)
        self.assertEqual(router.returncode, 0, said)
        self.tell("certificates, through a router", alone, over)

    def wait_for_traffic(self):
        """Until the run is well under way: its start takes some dozens of packets."""
        deadline = time.monotonic() + PATIENCE_S
        while self.relay.carried < 500:
            self.assertLess(time.monotonic(), deadline, "no traffic")
            time.sleep(0.01)


if __name__ == "__main__":
    atexit.register(remove_namespaces)
    # The bound on time of whoever calls this is no reason to leave namespaces behind.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    unittest.main(verbosity=2)
