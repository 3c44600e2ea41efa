"""Reads a recording with nothing but the `mcap` and `mcap-protobuf-support` packages.

    python read_recording.py FILE.mcap

Prints every topic with its number of messages and the first temperatures, and fails where a value is not finite.
"""

import math
import sys
from collections import Counter

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def main(path: str) -> int:
    counts: Counter[str] = Counter()
    first: list[float] | None = None
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            if not channel.topic.startswith("field/"):
                continue
            values = list(message.f64)
            if not all(map(math.isfinite, values)):
                print(f"{channel.topic}: a value is not finite at {message.envelope.version}", file=sys.stderr)
                return 1
            if first is None and channel.topic.endswith("/temperature") and values:
                first = values
        scene = next(attachment for attachment in reader.iter_attachments() if attachment.name == "scene.toml")
        run = next(metadata.metadata for metadata in reader.iter_metadata() if metadata.name == "stagger")
    print(f"run {run['run']}, seed {run['seed']}, scene of {len(scene.data)} bytes")
    for topic, count in sorted(counts.items()):
        print(f"{topic}: {count}")
    if first is not None:
        print("first temperatures:", first[:5])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
