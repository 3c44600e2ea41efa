"""The configuration of a node's session; `nodes/runtime/src/link/zenoh_config.rs` makes the same."""

import json
import tempfile
import unittest
from pathlib import Path

from stagger.link import settings

LEASE, WAIT = "transport/link/tx/lease", "transport/link/tx/queue/congestion_control/drop/wait_before_drop"
TLS = "transport/link/tls/"


class Settings(unittest.TestCase):
    def read(self, config, *keys):
        return [json.loads(config.get_json(key)) for key in keys]

    def test_nothing_is_looked_for_beyond_the_endpoint_and_nothing_put_into_shared_memory(self):
        found = settings("tcp/10.0.0.1:7447")
        keys = ("mode", "connect/endpoints", "scouting/multicast/enabled", "scouting/gossip/enabled", LEASE)
        self.assertEqual(self.read(found, *keys), ["client", ["tcp/10.0.0.1:7447"], False, False, 5000])
        shared = "transport/shared_memory/"
        # Others' shared memory is read.
        keys = (f"{shared}enabled", f"{shared}transport_optimization/enabled")
        self.assertEqual(self.read(found, *keys), [True, False])

    def test_a_file_changes_defaults_and_the_endpoint_given_wins(self):
        text = """{ mode: 'router', connect: { endpoints: ['tcp/0.0.0.0:1'] }, scouting: { gossip: { enabled: true } },
            listen: { endpoints: ['tcp/0.0.0.0:2'] }, transport: { link: { tx: { lease: 20000 },
            tls: { enable_mtls: true, root_ca_certificate: 'ca.crt', connect_private_key: '/own.key' } } } }"""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "zenoh.json5")
            file.write_text(text)
            found = settings("quic/10.0.0.1:7447", str(file))
        keys = ("mode", "connect/endpoints", "listen/endpoints", "scouting/gossip/enabled", LEASE, WAIT)
        fixed = ["client", ["quic/10.0.0.1:7447"], [], False]
        self.assertEqual(self.read(found, *keys), [*fixed, 20_000, 60_000_000])
        names = ("enable_mtls", "root_ca_certificate", "connect_private_key", "connect_certificate")
        said = [True, f"{folder}/ca.crt", "/own.key", None]
        self.assertEqual(self.read(found, *(TLS + name for name in names)), said)


if __name__ == "__main__":
    unittest.main()
